// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR to machine code for a CPU, as an object file or as assembly.

#ifndef PIKO_TARGET_OBJECT_H
#define PIKO_TARGET_OBJECT_H

#include "Piko/Driver/Options.h"
#include "Piko/Target/Processor.h"

#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

#include <string>

namespace piko {

enum class CodeFormat { Object, Assembly };

/// Optimises the module and makes position-independent code of it, for one
/// processor where functions do not say which they are for. Static initialisers
/// become one function, which JITCode runs.
llvm::Expected<std::string> generateCode(llvm::Module &module,
                                         const TargetOptions &options,
                                         CodeFormat format);

} // namespace piko

#endif // PIKO_TARGET_OBJECT_H
