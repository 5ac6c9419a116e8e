// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Runs passes on `.mlir` files.

#include "Piko/Driver/Registration.h"

#include "mlir/Tools/mlir-opt/MlirOptMain.h"

int main(int argc, char **argv) {
  mlir::DialectRegistry registry;
  piko::registerPikoDialects(registry);
  piko::registerPikoPasses();
  return mlir::asMainReturnCode(mlir::MlirOptMain(
      argc, argv, "Piko's optimizer: passes on .mlir files\n", registry));
}
