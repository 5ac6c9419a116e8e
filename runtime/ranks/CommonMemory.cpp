// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CommonMemory.cpp - Memory that ranks of one machine share ----------===//

#include "ranks/CommonMemory.h"

#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace piko::rt;

bool CommonMemory::map(int file, int64_t bytes) {
  void *data = mmap(nullptr, static_cast<size_t>(bytes), PROT_READ | PROT_WRITE,
                    MAP_SHARED, file, 0);
  if (data == MAP_FAILED)
    return false;
  data_ = static_cast<uint8_t *>(data);
  bytes_ = bytes;
  return true;
}

CommonMemory::Place CommonMemory::make(int64_t bytes) {
  reset();
  Place place;
  if (getrandom(place.token, sizeof place.token, 0) != sizeof place.token)
    return {};
  file_ = memfd_create("piko-ranks", MFD_CLOEXEC);
  // Memory that is only promised would end the process where it is missing.
  if (file_ < 0 || posix_fallocate(file_, 0, bytes + tokenBytes) != 0 ||
      !map(file_, bytes + tokenBytes)) {
    reset();
    return {};
  }
  std::memcpy(data_, place.token, sizeof place.token);
  place.process = getpid();
  place.file = file_;
  place.bytes = bytes;
  return place;
}

bool CommonMemory::find(const Place &place) {
  reset();
  if (place.file < 0)
    return false;
  std::string name = "/proc/" + std::to_string(place.process) + "/fd/" +
                     std::to_string(place.file);
  // What is not a file of memory may wait for whoever else opens it.
  int file = open(name.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  struct stat found;
  bool fits = file >= 0 && fstat(file, &found) == 0 && S_ISREG(found.st_mode) &&
              found.st_size == place.bytes + tokenBytes &&
              map(file, place.bytes + tokenBytes) &&
              std::memcmp(data_, place.token, sizeof place.token) == 0;
  if (file >= 0)
    ::close(file);
  if (!fits)
    reset();
  return fits;
}

void CommonMemory::close() {
  if (file_ >= 0)
    ::close(file_);
  file_ = -1;
}

void CommonMemory::reset() {
  close();
  if (data_)
    munmap(data_, static_cast<size_t>(bytes_));
  data_ = nullptr;
}
