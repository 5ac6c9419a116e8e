// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs passes on `.mlir` files.

#include "Piko/Driver/Registration.h"

#include "mlir/IR/MLIRContext.h"
#include "mlir/Tools/mlir-opt/MlirOptMain.h"
#include "llvm/Support/CommandLine.h"

/// Remarks point at lines: the operations that they are about would be pages.
/// The option still prints them.
static void leaveOutOperations() {
  mlir::registerMLIRContextCLOptions();
  auto &options = llvm::cl::getRegisteredOptions();
  auto *print = options.lookup("mlir-print-op-on-diagnostic");
  static_cast<llvm::cl::opt<bool> *>(print)->setInitialValue(false);
}

int main(int argc, char **argv) {
  leaveOutOperations();
  mlir::DialectRegistry registry;
  piko::registerPikoDialects(registry);
  piko::registerPikoPasses();
  return mlir::asMainReturnCode(mlir::MlirOptMain(
      argc, argv, "Piko's optimizer: passes on .mlir files\n", registry));
}
