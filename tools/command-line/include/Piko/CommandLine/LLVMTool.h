//===- LLVMTool.h - Files and options of LLVM's kind ------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What tools on LLVM's and MLIR's drivers say of wrong options and of files
// that cannot be read or written, as all tools of Piko do.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMMANDLINE_LLVMTOOL_H
#define PIKO_COMMANDLINE_LLVMTOOL_H

#include "llvm/ADT/StringRef.h"

#include <memory>
#include <string>

namespace llvm {
class MemoryBuffer;
} // namespace llvm

namespace piko {

class LLVMTool {
public:
  explicit LLVMTool(std::string name) : name(std::move(name)) {}

  /// Reads the options that are registered; false after an error.
  bool parseOptions(int argc, const char *const *argv,
                    llvm::StringRef overview = "") const;
  /// Of "-" the standard input; null after an error.
  std::unique_ptr<llvm::MemoryBuffer> open(const std::string &path) const;
  /// Of "-" the standard output; false after an error.
  bool write(const std::string &path, llvm::StringRef content) const;
  /// Says what is wrong; false.
  bool fail(llvm::StringRef message) const;

private:
  std::string name;
};

} // namespace piko

#endif // PIKO_COMMANDLINE_LLVMTOOL_H
