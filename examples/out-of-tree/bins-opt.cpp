// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko-opt is, and scale-bins.

#include "ScaleBins.h"

#include "Piko/Driver/Registration.h"

#include "mlir/Tools/mlir-opt/MlirOptMain.h"

int main(int argc, char **argv) {
  mlir::DialectRegistry registry;
  piko::registerPikoDialects(registry);
  piko::registerPikoPasses();
  registerScaleBins();
  return mlir::asMainReturnCode(mlir::MlirOptMain(
      argc, argv, "Passes on pipelines, and scale-bins\n", registry));
}
