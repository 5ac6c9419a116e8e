//===- OutputFile.h - Files and results that are written --------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_OUTPUTFILE_H
#define PIKO_SCENE_OUTPUTFILE_H

#include "Piko/Scene/Result.h"

#include <string>
#include <string_view>

namespace piko::render {

/// Replaces a file, or makes one. It is written beside its place, without a
/// name where the file system can, and renamed when all of it is there: after
/// an error or a signal the old file is as it was, and nothing is left.
///
/// The permissions of an old file are kept, and a symbolic link stays one.
/// Where the folder takes no new file, an old one is written in its place, and
/// gets back what it held when that fails. Devices and pipes are written
/// directly.
///
/// The error names no file: it is why alone, such as "no space left on device".
Result<Done> replaceFile(const std::string &path, std::string_view content);

/// The same, with "cannot write 'PATH': " in front of the error.
Result<Done> writeFile(const std::string &path, std::string_view content);

/// Writes out what is buffered for the standard output. Each tool calls it
/// last, for a full disk is seen no sooner.
Result<Done> finishOutput();

} // namespace piko::render

#endif // PIKO_SCENE_OUTPUTFILE_H
