//===- OutputFile.h - Files and results that are written --------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SUPPORT_OUTPUTFILE_H
#define PIKO_SUPPORT_OUTPUTFILE_H

#include "Piko/Support/Result.h"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace piko::support {

class HeldSignals;
class OutputPlace;

/// Files that are replaced, or made, together. Each is written beside its
/// place, without a name where the file system can, and renamed when all that
/// there is is written: after an error or a signal the old files are as they
/// were, and nothing is left.
///
/// The permissions of an old file are kept, and a symbolic link stays one.
/// Where the folder takes no new file, an old one is written in its place, and
/// gets back what it held when that fails. Devices, pipes and "-", the standard
/// output, are written directly. What is not written beside its place is
/// written first of all, at the end.
class OutputFiles {
public:
  OutputFiles();
  OutputFiles(const OutputFiles &) = delete;
  OutputFiles &operator=(const OutputFiles &) = delete;
  /// Drops what was not kept.
  ~OutputFiles();

  /// "cannot write 'PATH': " and why, as keep() has it.
  Result<Done> add(const std::string &path, std::string_view content);
  /// Puts all files in their places.
  Result<Done> keep();

private:
  std::unique_ptr<HeldSignals> held;
  std::vector<std::unique_ptr<OutputPlace>> places;
};

/// One file. The error does not name it: it is why alone, such as "no space
/// left on device".
Result<Done> replaceFile(const std::string &path, std::string_view content);

/// The same, with "cannot write 'PATH': " before the error.
Result<Done> writeFile(const std::string &path, std::string_view content);

/// Whether a file could be written, with writeFile's error if not; for before
/// what takes long. It changes nothing.
Result<Done> checkWritable(const std::string &path);

/// Writes out what is buffered for the standard output. Each tool calls it
/// last, for a full disk is seen no sooner.
Result<Done> finishOutput();

} // namespace piko::support

#endif // PIKO_SUPPORT_OUTPUTFILE_H
