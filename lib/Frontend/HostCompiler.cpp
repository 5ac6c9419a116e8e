// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine.

#include "Piko/Frontend/HostCompiler.h"

#include "Support/Shifts.h"
#include "Clang/ClangDiagnostics.h"
#include "Clang/ClangInvocation.h"
#include "Clang/PrecompiledHeader.h"
#include "clang/CodeGen/CodeGenAction.h"
#include "clang/Frontend/CompilerInstance.h"
#include "clang/Lex/PreprocessorOptions.h"
#include "llvm/Support/VirtualFileSystem.h"

using namespace piko;

static constexpr llvm::StringLiteral mainName = "<piko-reference>";
static constexpr llvm::StringLiteral headerName = "/<piko-header-code>";
static constexpr llvm::StringLiteral headerPath = "/<piko-reference>.pch";

using Files = HeaderStore::Files;

/// Without optimization the header's functions have code of their own, so that
/// it is not made for each file.
static llvm::SmallVector<const char *> getFlags(bool optimize) {
  llvm::SmallVector<const char *> flags = {optimize ? "-O1" : "-O0", "-fPIC",
                                           "-fwrapv",
                                           "-fno-strict-float-cast-overflow"};
  if (!optimize)
    flags.append({"-Xclang", "-fmodules-codegen"});
  return flags;
}

static Files openFiles(const FrontendOptions &options) {
  return options.files ? options.files : llvm::vfs::getRealFileSystem();
}

namespace {

/// One run of Clang after a precompiled header, if there is one.
class HostCompiler {
public:
  HostCompiler(const FrontendOptions &options, bool optimize,
               llvm::LLVMContext &llvmContext, mlir::MLIRContext &context)
      : options(options), flags(getFlags(optimize)),
        files(llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(
            openFiles(options))),
        llvmContext(llvmContext), forwarder(context) {
    files->pushOverlay(memory);
    invocation = invoke(options, clang::CompilerInstance::createDiagnostics(
                                     *files, diagnosticOptions, &forwarder,
                                     /*ShouldOwnClient=*/false));
  }

  /// Whether there is one for that file.
  bool readHeader(llvm::StringRef userFile) {
    return invocation &&
           readHeader(getPrecompiledHeader(
               userFile, options, flags, files,
               [&](const FrontendOptions &chosen, auto diagnostics) {
                 return invoke(chosen, diagnostics);
               }));
  }

  bool readHeaderOf(llvm::StringRef text, llvm::StringRef name) {
    memory->addFile(name, 0, llvm::MemoryBuffer::getMemBufferCopy(text));
    return readHeader(name);
  }

  std::unique_ptr<llvm::Module>
  compile(llvm::StringRef text, llvm::StringRef name, bool emitsHeader) {
    if (!invocation)
      return nullptr;
    // Whoever makes code of it runs the optimizer, and once is enough.
    invocation->getCodeGenOpts().DisableLLVMPasses = true;
    invocation->getCodeGenOpts().DiscardValueNames = true;
    invocation->getLangOpts().BuildingPCHWithObjectFile = emitsHeader;
    // The text is in memory; nothing is read from a file of that name.
    std::unique_ptr<llvm::MemoryBuffer> buffer =
        llvm::MemoryBuffer::getMemBuffer(text, name);
    invocation->getFrontendOpts().Inputs = {clang::FrontendInputFile(
        buffer->getMemBufferRef(), clang::InputKind(clang::Language::CXX))};
    clang::CompilerInstance compiler(invocation);
    compiler.setVirtualFileSystem(files);
    compiler.setVerboseOutputStream(llvm::nulls());
    compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
    clang::EmitLLVMOnlyAction action(&llvmContext);
    bool ok = compiler.ExecuteAction(action);
    forwarder.flush();
    if (!ok)
      return nullptr;
    std::unique_ptr<llvm::Module> module = action.takeModule();
    // As in compiled pipelines, which these are the reference of.
    for (llvm::Function &function : *module)
      defineShifts(function);
    return module;
  }

private:
  std::shared_ptr<clang::CompilerInvocation>
  invoke(const FrontendOptions &chosen,
         llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine> diagnostics) {
    return createClangInvocation(flags, chosen, mainName, diagnostics);
  }

  bool readHeader(std::unique_ptr<llvm::MemoryBuffer> header) {
    if (!header)
      return false;
    memory->addFile(headerPath, 0, std::move(header));
    clang::PreprocessorOptions &preprocessor =
        invocation->getPreprocessorOpts();
    preprocessor.ImplicitPCHInclude = headerPath;
    preprocessor.DisablePCHOrModuleValidation =
        clang::DisableValidationForModuleKind::All;
    return true;
  }

  const FrontendOptions &options;
  llvm::SmallVector<const char *> flags;
  llvm::IntrusiveRefCntPtr<llvm::vfs::InMemoryFileSystem> memory =
      llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  llvm::IntrusiveRefCntPtr<llvm::vfs::OverlayFileSystem> files;
  llvm::LLVMContext &llvmContext;
  ClangDiagnosticForwarder forwarder;
  clang::DiagnosticOptions diagnosticOptions;
  std::shared_ptr<clang::CompilerInvocation> invocation;
};

} // namespace

std::vector<std::string> piko::getHostArguments(const FrontendOptions &options,
                                                bool optimize) {
  return getClangArguments(getFlags(optimize), options);
}

HostCode piko::compileForHost(llvm::StringRef text, llvm::StringRef userFile,
                              const FrontendOptions &options, bool optimize,
                              llvm::LLVMContext &llvmContext,
                              mlir::MLIRContext &context) {
  HostCompiler compiler(options, optimize, llvmContext, context);
  bool hasHeader = compiler.readHeader(userFile);
  std::string mainText = hasHeader ? getTextAfterHeader(options) : "";
  mainText += text;
  return {compiler.compile(mainText, mainName, /*emitsHeader=*/false),
          hasHeader && !optimize};
}

std::unique_ptr<llvm::MemoryBuffer> piko::getHeaderCode(
    const FrontendOptions &options, llvm::StringRef target,
    llvm::function_ref<std::optional<std::string>(llvm::Module &)> generate,
    mlir::MLIRContext &context) {
  FrontendOptions shared = getHeaderOptions(options);
  std::vector<std::string> request =
      getHostArguments(shared, /*optimize=*/false);
  request.push_back(("code for " + target).str());
  auto make = [&](const Files &recorded) -> std::optional<std::string> {
    FrontendOptions chosen = shared;
    chosen.files = recorded;
    llvm::LLVMContext llvmContext;
    HostCompiler compiler(chosen, /*optimize=*/false, llvmContext, context);
    if (!compiler.readHeaderOf("#include <piko.h>\n", headerName))
      return std::nullopt;
    std::unique_ptr<llvm::Module> module =
        compiler.compile("", headerName, /*emitsHeader=*/true);
    return module ? generate(*module) : std::nullopt;
  };
  return options.headers->get(request, openFiles(options), make);
}
