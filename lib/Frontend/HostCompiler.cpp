// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine.

#include "Piko/Frontend/HostCompiler.h"

#include "Parse/ClangDiagnostics.h"
#include "Parse/ClangInvocation.h"
#include "clang/CodeGen/CodeGenAction.h"
#include "clang/Frontend/CompilerInstance.h"
#include "llvm/Support/VirtualFileSystem.h"

using namespace piko;

static constexpr llvm::StringLiteral mainName = "<piko-reference>";

std::unique_ptr<llvm::Module>
piko::compileForHost(llvm::StringRef text, const FrontendOptions &options,
                     bool optimize, llvm::LLVMContext &llvmContext,
                     mlir::MLIRContext &context) {
  auto files = options.files ? options.files : llvm::vfs::getRealFileSystem();
  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  std::shared_ptr<clang::CompilerInvocation> invocation =
      createClangInvocation({optimize ? "-O2" : "-O0", "-fPIC", "-fwrapv",
                             "-fno-strict-float-cast-overflow"},
                            options, mainName,
                            clang::CompilerInstance::createDiagnostics(
                                *files, diagnosticOptions, &forwarder,
                                /*ShouldOwnClient=*/false));
  if (!invocation)
    return nullptr;
  // The text is in memory; nothing is read from a file of that name.
  std::unique_ptr<llvm::MemoryBuffer> buffer =
      llvm::MemoryBuffer::getMemBufferCopy(text, mainName);
  invocation->getFrontendOpts().Inputs = {clang::FrontendInputFile(
      buffer->getMemBufferRef(), clang::InputKind(clang::Language::CXX))};
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(files);
  compiler.setVerboseOutputStream(llvm::nulls());
  compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
  clang::EmitLLVMOnlyAction action(&llvmContext);
  bool ok = compiler.ExecuteAction(action);
  forwarder.flush();
  return ok ? action.takeModule() : nullptr;
}
