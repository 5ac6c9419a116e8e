// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR of a file, divided among its pipelines: the wrappers of each have
// names with an end of its own.

#ifndef PIKO_LIB_FRONTEND_PARSE_UNITMODULES_H
#define PIKO_LIB_FRONTEND_PARSE_UNITMODULES_H

#include "llvm/ADT/StringRef.h"
#include "llvm/IR/Module.h"

#include <memory>

namespace piko {

/// Passes choose widths of numbers as for the target of the calling convention;
/// nothing throws, since what would is refused.
void adaptModule(llvm::Module &module);

/// A module of the one pipeline's wrappers and all that they need.
std::unique_ptr<llvm::Module> extractUnit(const llvm::Module &module,
                                          llvm::StringRef suffix);

/// Gives wrappers the names that the rest of the front end finds them by.
void dropSuffix(llvm::Module &module, llvm::StringRef suffix);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_UNITMODULES_H
