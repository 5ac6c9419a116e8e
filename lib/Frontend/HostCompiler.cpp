// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine.

#include "Piko/Frontend/HostCompiler.h"

#include "ClangDiagnostics.h"
#include "clang/CodeGen/CodeGenAction.h"
#include "clang/Driver/CreateInvocationFromArgs.h"
#include "clang/Frontend/CompilerInstance.h"
#include "llvm/Support/VirtualFileSystem.h"

using namespace piko;

static constexpr llvm::StringLiteral mainName = "<piko-reference>";

std::unique_ptr<llvm::Module>
piko::compileForHost(llvm::StringRef text, const FrontendOptions &options,
                     llvm::LLVMContext &llvmContext,
                     mlir::MLIRContext &context) {
  std::vector<std::string> arguments = {
      "clang++",
      "-std=c++20",
      "-fsyntax-only",
      "-xc++",
      "-O2",
      "-ffp-contract=off",
      "-fPIC",
      "-resource-dir",
      options.resourceDir.empty() ? PIKO_CLANG_RESOURCE_DIR
                                  : options.resourceDir,
      "-isystem",
      options.runtimeIncludeDir.empty() ? PIKO_RUNTIME_INCLUDE_DIR
                                        : options.runtimeIncludeDir};
  for (const std::string &directory : options.includeDirs)
    arguments.push_back("-I" + directory);
  for (const std::string &macro : options.defines)
    arguments.push_back("-D" + macro);
  arguments.push_back(mainName.str());
  std::vector<const char *> argv;
  for (const std::string &argument : arguments)
    argv.push_back(argument.c_str());

  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  clang::CreateInvocationOptions createOptions;
  createOptions.Diags = clang::CompilerInstance::createDiagnostics(
      *llvm::vfs::getRealFileSystem(), diagnosticOptions, &forwarder,
      /*ShouldOwnClient=*/false);
  std::shared_ptr<clang::CompilerInvocation> invocation =
      clang::createInvocation(argv, createOptions);
  if (!invocation)
    return nullptr;
  // The text is in memory; nothing is read from a file of that name.
  std::unique_ptr<llvm::MemoryBuffer> buffer =
      llvm::MemoryBuffer::getMemBufferCopy(text, mainName);
  invocation->getFrontendOpts().Inputs = {clang::FrontendInputFile(
      buffer->getMemBufferRef(), clang::InputKind(clang::Language::CXX))};
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(llvm::vfs::getRealFileSystem());
  compiler.setVerboseOutputStream(llvm::nulls());
  compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
  clang::EmitLLVMOnlyAction action(&llvmContext);
  bool ok = compiler.ExecuteAction(action);
  forwarder.flush();
  return ok ? action.takeModule() : nullptr;
}
