// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What make and ninja are told of the files that were read.

#ifndef PIKO_TOOLS_PIKOC_DEPENDENCIES_H
#define PIKO_TOOLS_PIKOC_DEPENDENCIES_H

#include "llvm/ADT/ArrayRef.h"

#include <string>

namespace piko {

/// The rule of a Makefile that makes `targets` anew when a file changes.
std::string writeDependencies(llvm::ArrayRef<std::string> targets,
                              llvm::ArrayRef<std::string> files);

} // namespace piko

#endif // PIKO_TOOLS_PIKOC_DEPENDENCIES_H
