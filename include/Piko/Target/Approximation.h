// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The functions of Piko/Conversion/Approximations.h in LLVM IR.

#ifndef PIKO_TARGET_APPROXIMATION_H
#define PIKO_TARGET_APPROXIMATION_H

#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/Module.h"

#include <optional>

namespace piko {

enum class Approximation { Reciprocal, Rsqrt, Sqrt };

/// Which approximation a function is declared for.
std::optional<Approximation> getApproximation(const llvm::Function &function);

/// One step of Newton's method from what an instruction gives: about 1 / x for
/// a reciprocal, otherwise 1 / sqrt(x). To have the same bits everywhere, it is
/// the same for a number as for each one of a vector.
llvm::Value *refine(llvm::IRBuilderBase &builder, Approximation kind,
                    llvm::Value *x, llvm::Value *first);

/// What is approximated itself, as processors compute it that have no such
/// instruction.
llvm::Value *computeExactly(llvm::IRBuilderBase &builder, Approximation kind,
                            llvm::Value *x);

/// Puts what `write` makes of the operand in place of each call, and removes
/// the functions.
void replaceApproximations(
    llvm::Module &module,
    llvm::function_ref<llvm::Value *(llvm::IRBuilderBase &, Approximation,
                                     llvm::Value *x)>
        write);

} // namespace piko

#endif // PIKO_TARGET_APPROXIMATION_H
