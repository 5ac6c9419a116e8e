//===- Translate.cpp - piko-translate --cpp-to-piko -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Frontend/Frontend.h"
#include "mlir/Tools/mlir-translate/Translation.h"
#include "llvm/Support/CommandLine.h"
#include "llvm/Support/SourceMgr.h"

using namespace piko;

void piko::registerCppToPikoTranslation(std::shared_ptr<HeaderStore> headers) {
  static llvm::cl::list<std::string> includeDirs(
      "I", llvm::cl::Prefix,
      llvm::cl::desc("Search this directory for headers"));
  static llvm::cl::list<std::string> defines(
      "D", llvm::cl::Prefix, llvm::cl::desc("Define this macro"));
  static llvm::cl::opt<std::string> pipe(
      "pipe", llvm::cl::desc("The pipeline to compile"));
  static mlir::TranslateToMLIRRegistration registration(
      "cpp-to-piko", "compile a pipeline in C++ to the piko dialect",
      [headers](llvm::SourceMgr &sources, mlir::MLIRContext *context)
          -> mlir::OwningOpRef<mlir::Operation *> {
        const llvm::MemoryBuffer *buffer =
            sources.getMemoryBuffer(sources.getMainFileID());
        FrontendOptions options;
        options.includeDirs = includeDirs;
        options.defines = defines;
        options.pipeName = pipe;
        options.headers = headers;
        llvm::StringRef name = buffer->getBufferIdentifier();
        mlir::OwningOpRef<mlir::ModuleOp> module =
            translateCppToPiko(name == "-" ? "<stdin>" : name,
                               buffer->getBuffer(), options, *context);
        return mlir::OwningOpRef<mlir::Operation *>(
            module ? module.release().getOperation() : nullptr);
      },
      [](mlir::DialectRegistry &registry) { registry.insert<PikoDialect>(); });
}
