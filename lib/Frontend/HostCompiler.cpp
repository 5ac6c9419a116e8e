// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine.

#include "Piko/Frontend/HostCompiler.h"

#include "Parse/ClangDiagnostics.h"
#include "Parse/ClangInvocation.h"
#include "Parse/PrecompiledHeader.h"
#include "clang/CodeGen/CodeGenAction.h"
#include "clang/Frontend/CompilerInstance.h"
#include "clang/Lex/PreprocessorOptions.h"
#include "llvm/Support/VirtualFileSystem.h"

using namespace piko;

static constexpr llvm::StringLiteral mainName = "<piko-reference>";
static constexpr llvm::StringLiteral headerPath = "/<piko-reference>.pch";

std::unique_ptr<llvm::Module>
piko::compileForHost(llvm::StringRef text, llvm::StringRef userFile,
                     const FrontendOptions &options, bool optimize,
                     llvm::LLVMContext &llvmContext,
                     mlir::MLIRContext &context) {
  auto memory = llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  auto files = llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(
      options.files ? options.files : llvm::vfs::getRealFileSystem());
  files->pushOverlay(memory);
  const char *const flags[] = {optimize ? "-O1" : "-O0", "-fPIC", "-fwrapv",
                               "-fno-strict-float-cast-overflow"};
  auto invoke = [&](const FrontendOptions &chosen, auto diagnostics) {
    return createClangInvocation(flags, chosen, mainName, diagnostics);
  };
  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  std::shared_ptr<clang::CompilerInvocation> invocation =
      invoke(options, clang::CompilerInstance::createDiagnostics(
                          *files, diagnosticOptions, &forwarder,
                          /*ShouldOwnClient=*/false));
  if (!invocation)
    return nullptr;
  // Whoever makes code of it runs the optimizer, and once is enough.
  invocation->getCodeGenOpts().DisableLLVMPasses = true;
  invocation->getCodeGenOpts().DiscardValueNames = true;
  std::string mainText;
  if (std::unique_ptr<llvm::MemoryBuffer> header = getPrecompiledHeader(
          userFile, options, flags, files, invoke, headerPath)) {
    memory->addFile(headerPath, 0, std::move(header));
    mainText = getTextBehindHeader(options);
    clang::PreprocessorOptions &preprocessor =
        invocation->getPreprocessorOpts();
    preprocessor.ImplicitPCHInclude = headerPath;
    preprocessor.DisablePCHOrModuleValidation =
        clang::DisableValidationForModuleKind::All;
  }
  mainText += text;
  // The text is in memory; nothing is read from a file of that name.
  std::unique_ptr<llvm::MemoryBuffer> buffer =
      llvm::MemoryBuffer::getMemBuffer(mainText, mainName);
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
