//===- Shifts.h - Shifts by any amount --------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_SUPPORT_SHIFTS_H
#define PIKO_LIB_FRONTEND_SUPPORT_SHIFTS_H

namespace llvm {
class Function;
} // namespace llvm

namespace piko {

/// A shift by as many bits as its operand has, or more, is poison in LLVM IR.
/// In Piko its amount is taken modulo their number: masks amounts that may be
/// too large.
void defineShifts(llvm::Function &function);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_SUPPORT_SHIFTS_H
