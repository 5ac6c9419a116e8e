// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Takes pipelines in and out of MLIR: C++ in; LLVM IR and Graphviz out.

#include "Piko/CommandLine/Help.h"
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

static const piko::ToolHelp help{
    .usage = "piko-translate [options] FILE",
    .description =
        "Takes pipelines in and out of MLIR. C++ comes in, LLVM IR and "
        "Graphviz go out.",
    .example = "piko-translate --piko-to-dot dots.mlir | dot -Tsvg -o dots.svg",
    .options = {{.names = {"--cpp-to-piko"},
                 .brief = "a pipeline in C++ to the piko dialect"},
                {.names = {"--pipe"},
                 .value = "NAME",
                 .brief = "which pipeline of the file"},
                {.names = {"--piko-to-dot"},
                 .brief = "pipelines as graphs for Graphviz"},
                {.names = {"--mlir-to-llvmir"},
                 .brief = "the llvm and omp dialects to LLVM IR"},
                {.names = {"-o"}, .value = "FILE", .brief = "where to write"}},
    .isLLVMs = true};

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
  if (piko::answerHelp(help, argc, argv))
    return 0;
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
