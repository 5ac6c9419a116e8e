//===- PackedFile.h - Files that may be gzipped -----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_PACKEDFILE_H
#define PIKO_TOOLS_SCENE_PACKEDFILE_H

#include "Piko/Scene/Result.h"
#include "Piko/Support/OutOfMemory.h"

#include <cstdint>
#include <string>

namespace piko::render {

/// The content of a file, unpacked if it is gzipped: a small file may unpack to
/// a thousand times as much, which ends at `most` bytes. The error says why
/// alone.
Result<std::string> readFile(const std::string &path,
                             uint64_t most = support::memoryOfMachine());

/// The extension that says the format, without ".gz": lowercase and with its
/// dot.
std::string formatOf(const std::string &path);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_PACKEDFILE_H
