// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A program whose code is there for several processors.

#ifndef PIKO_TARGET_VERSIONS_H
#define PIKO_TARGET_VERSIONS_H

#include "Piko/Target/Processor.h"

#include "llvm/IR/Module.h"

#include <memory>
#include <vector>

namespace piko {

/// Takes a module for each processor, with the functions `pipeline`.setup and
/// `pipeline`.run, and gives one for `triple` that has the functions of all. It
/// defines `symbol`, the pikort_program of the pipeline, and hides all else.
/// What is not said to be for a processor is for the least one.
std::unique_ptr<llvm::Module>
defineProgram(std::vector<std::unique_ptr<llvm::Module>> modules,
              llvm::StringRef pipeline, llvm::StringRef symbol,
              llvm::ArrayRef<Processor> processors, const llvm::Triple &triple);

} // namespace piko

#endif // PIKO_TARGET_VERSIONS_H
