// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Takes pipelines in and out of MLIR: C++ in; LLVM IR and Graphviz out.

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Registration.h"
#include "Piko/Frontend/Frontend.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Target/Graphviz.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/Tools/mlir-translate/MlirTranslateMain.h"
#include "mlir/Tools/mlir-translate/Translation.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

static mlir::LogicalResult exportLLVMIR(mlir::Operation *op,
                                        llvm::raw_ostream &stream) {
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> module =
      piko::translate(op, context, "pipeline");
  if (!module)
    return mlir::failure();
  module->print(stream, nullptr);
  return mlir::success();
}

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-translate");
  piko::registerCppToPikoTranslation(piko::makeHeaderStore({}));
  piko::registerPikoToDotTranslation();
  mlir::TranslateFromMLIRRegistration toLLVMIR(
      "mlir-to-llvmir", "translate the llvm and omp dialects to LLVM IR",
      exportLLVMIR, piko::registerPikoDialects);
  return piko::runMainOnDeepStack([&]() -> int {
    return mlir::failed(mlir::mlirTranslateMain(
        argc, argv, "Piko's translator: C++ in, LLVM IR and Graphviz out"));
  });
}
