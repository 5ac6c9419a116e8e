// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An update that tests a pixel and overwrites it, as one that tests it and one
// that overwrites it.

#ifndef PIKO_LIB_TRANSFORMS_SPLITUPDATE_H
#define PIKO_LIB_TRANSFORMS_SPLITUPDATE_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// How an update chooses a number: another value where the condition has that
/// outcome, or else the old one.
struct Choice {
  mlir::Value condition;
  bool outcome;
  mlir::Value value;
};
/// The choice whose result is `value`, one of whose sides is `old`.
std::optional<Choice> getChoice(mlir::Value value, mlir::Value old);

/// Takes an update that gives some numbers of a pixel other values on one
/// condition, values that have nothing to do with what the pixel was, and
/// makes of it one update that leaves these numbers, and, where the condition
/// holds, one after it that overwrites them. Does nothing to others, or where
/// `isWorthwhile` is false for the operations that the values are computed by.
/// Whether it has done something.
bool splitUpdate(
    UpdateOp update,
    llvm::function_ref<bool(llvm::ArrayRef<mlir::Operation *>)> isWorthwhile);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SPLITUPDATE_H
