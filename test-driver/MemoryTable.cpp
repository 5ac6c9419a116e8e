// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- MemoryTable.cpp - Allocations by their addresses -------------------===//

#include "State.h"

#include <algorithm>
#include <cstring>
#include <sys/mman.h>
#include <unistd.h>

using namespace piko::testdriver;

static constexpr uint64_t page = 4096;
/// More than this is filled where it is touched, which alone takes memory.
static constexpr uint64_t filledBytes = uint64_t(4) << 20;
static constexpr size_t remembered = 64;

static uint8_t *map(uint64_t bytes, int protection) {
  void *memory = mmap(nullptr, bytes, protection,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<uint8_t *>(memory);
}

/// A file of so many bytes that nobody has written; -1: there is none.
static int openUnwritten() {
  int file = memfd_create("unwritten", MFD_CLOEXEC);
  if (file < 0 || ftruncate(file, filledBytes) != 0)
    return -1;
  void *bytes =
      mmap(nullptr, filledBytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (bytes == MAP_FAILED)
    return -1;
  std::memset(bytes, piko::ptx::unwritten, filledBytes);
  munmap(bytes, filledBytes);
  return file;
}

/// Puts copies of that file, made page by page as they are written, in the
/// place of memory that is mapped. False if the system refuses.
static bool fillLater(uint8_t *memory, uint64_t bytes) {
  static const int file = openUnwritten();
  for (uint64_t done = 0; file >= 0 && done < bytes; done += filledBytes)
    if (mmap(memory + done, std::min(filledBytes, bytes - done),
             PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_FIXED | MAP_NORESERVE,
             file, 0) == MAP_FAILED)
      return false;
  return file >= 0;
}

/// Whole pages; null if the system refuses.
static uint8_t *mapUnwritten(uint64_t bytes) {
  uint8_t *memory = map(bytes, PROT_READ | PROT_WRITE);
  if (!memory)
    return nullptr;
  if (bytes <= filledBytes) {
    std::memset(memory, piko::ptx::unwritten, bytes);
  } else if (!fillLater(memory, bytes)) {
    munmap(memory, bytes);
    return nullptr;
  }
  return memory;
}

const Allocation *MemoryTable::allocate(AllocationKind kind, uint64_t bytes) {
  Allocation made;
  made.kind = kind;
  made.bytes = bytes;
  if (bytes > UINT64_MAX - 2 * page)
    return nullptr;
  made.mapped = (bytes + page - 1) / page * page;
  made.memory = mapUnwritten(made.mapped);
  if (!made.memory)
    return nullptr;
  made.begin = reinterpret_cast<uint64_t>(made.memory);
  if (kind == AllocationKind::Device) {
    // Addresses of which the host can use none.
    uint8_t *reserved = map(made.mapped, PROT_NONE);
    if (!reserved) {
      munmap(made.memory, made.mapped);
      return nullptr;
    }
    made.begin = reinterpret_cast<uint64_t>(reserved);
    used += bytes;
  }
  return &(allocations[made.begin] = made);
}

void MemoryTable::release(uint64_t address) {
  auto found = allocations.find(address);
  const Allocation &it = found->second;
  munmap(it.memory, it.mapped);
  if (it.kind == AllocationKind::Device) {
    munmap(reinterpret_cast<void *>(it.begin), it.mapped);
    used -= it.bytes;
  }
  if (released.size() == remembered)
    released.erase(released.begin());
  released.push_back(it);
  allocations.erase(found);
}

void MemoryTable::clear() {
  while (!allocations.empty())
    release(allocations.begin()->first);
  released.clear();
}

const Allocation *MemoryTable::at(uint64_t address) const {
  auto after = allocations.upper_bound(address);
  if (after == allocations.begin())
    return nullptr;
  const Allocation &it = std::prev(after)->second;
  return address - it.begin < it.bytes ? &it : nullptr;
}

piko::ptx::Memory::Range MemoryTable::find(uint64_t address) const {
  const Allocation *it = at(address);
  if (!it)
    return {};
  return {it->begin, it->begin + it->bytes,
          reinterpret_cast<uint64_t>(it->memory) - it->begin};
}

std::string MemoryTable::describe(uint64_t address) const {
  auto byteOf = [&](const Allocation &it) {
    return "byte " + std::to_string(address - it.begin) + " of ";
  };
  for (const Allocation &it : released)
    if (address - it.begin < it.bytes && !at(address))
      return byteOf(it) + std::to_string(it.bytes) + " that were freed";
  auto after = allocations.upper_bound(address);
  if (after == allocations.begin())
    return {};
  const Allocation &it = std::prev(after)->second;
  return address - it.begin < it.mapped + page
             ? byteOf(it) + "an allocation of " + std::to_string(it.bytes)
             : std::string();
}
