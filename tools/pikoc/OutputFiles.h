// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Files that appear together, or not at all.

#ifndef PIKO_TOOLS_PIKOC_OUTPUTFILES_H
#define PIKO_TOOLS_PIKOC_OUTPUTFILES_H

#include "llvm/ADT/StringRef.h"
#include "llvm/Support/Error.h"
#include "llvm/Support/FileSystem.h"

#include <string>
#include <vector>

namespace piko {

/// Texts go to temporary files beside the real ones, and are renamed at the
/// end. "-" is standard output; devices and pipes are written to at the end.
class OutputFiles {
public:
  ~OutputFiles();
  llvm::Error add(llvm::StringRef path, llvm::StringRef text);
  llvm::Error keep();

private:
  struct Pending {
    std::string path;
    llvm::sys::fs::TempFile file;
  };
  struct Direct {
    std::string path, text;
  };
  std::vector<Pending> pending;
  std::vector<Direct> direct;
};

/// The rule of a Makefile that makes `targets` anew when a file changes.
std::string writeDependencies(llvm::ArrayRef<std::string> targets,
                              llvm::ArrayRef<std::string> files);

} // namespace piko

#endif // PIKO_TOOLS_PIKOC_OUTPUTFILES_H
