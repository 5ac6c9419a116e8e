//===- PackedFile.cpp - Files that may be gzipped -------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PackedFile.h"

#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>
#include <zlib.h>

using namespace piko;
using namespace piko::render;

Result<std::string> render::readFile(const std::string &path, uint64_t most) {
  gzFile file = gzopen(path.c_str(), "rb");
  if (!file)
    return Error{std::strerror(errno)};
  std::string content;
  std::vector<char> chunk(1 << 20);
  int got;
  while ((got = gzread(file, chunk.data(), unsigned(chunk.size()))) > 0) {
    if (content.size() + size_t(got) > most) {
      gzclose_r(file);
      return Error{"it is, or unpacks to, more than the machine's memory of " +
                   std::to_string(most) + " bytes"};
    }
    content.append(chunk.data(), size_t(got));
  }
  int code;
  std::string message = gzerror(file, &code);
  bool isWhole = gzclose_r(file) == Z_OK && got == 0 && code == Z_OK;
  if (!isWhole)
    return Error{"it does not unpack: " +
                 (message.empty() ? "it is cut short" : message)};
  return content;
}

std::string render::formatOf(const std::string &name) {
  std::filesystem::path path = name;
  if (path.extension() == ".gz")
    path = path.stem();
  std::string format = path.extension().string();
  for (char &c : format)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return format;
}
