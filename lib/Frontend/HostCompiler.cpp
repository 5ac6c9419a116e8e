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
      "clang++", "-std=c++20", "-fsyntax-only", "-xc++", "-O2",
      "-ffp-contract=off", "-fPIC", "-resource-dir",
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

  auto memory = llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  memory->addFile(mainName, 0, llvm::MemoryBuffer::getMemBufferCopy(text));
  auto files = llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(
      llvm::vfs::getRealFileSystem());
  files->pushOverlay(memory);

  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  clang::CreateInvocationOptions createOptions;
  createOptions.VFS = files;
  createOptions.Diags = clang::CompilerInstance::createDiagnostics(
      *files, diagnosticOptions, &forwarder, /*ShouldOwnClient=*/false);
  std::shared_ptr<clang::CompilerInvocation> invocation =
      clang::createInvocation(argv, createOptions);
  if (!invocation)
    return nullptr;
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(files);
  compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
  clang::EmitLLVMOnlyAction action(&llvmContext);
  bool ok = compiler.ExecuteAction(action);
  forwarder.flush();
  return ok ? action.takeModule() : nullptr;
}
