// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What every tool registers. Kept apart from the compiler's driver so that
// tools which parse no C++ do not load Clang.

#ifndef PIKO_DRIVER_REGISTRATION_H
#define PIKO_DRIVER_REGISTRATION_H

#include "mlir/IR/DialectRegistry.h"
#include "mlir/IR/MLIRContext.h"

namespace piko {

/// All dialects that a pipeline meets on its way, and what takes them to LLVM.
void registerPikoDialects(mlir::DialectRegistry &registry);

/// A context of all of them, which has threads where the system gives some.
class PikoContext : public mlir::MLIRContext {
public:
  PikoContext();
};

/// Piko's passes and its sequences of passes, and those of upstream that work
/// between them.
void registerPikoPasses();

} // namespace piko

#endif // PIKO_DRIVER_REGISTRATION_H
