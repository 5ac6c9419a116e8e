//===- Parse.cpp - Running Clang on a pipeline's file ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// One parse does it all. The main buffer is ours:
//
//   #pragma piko_file
//   #pragma piko_wrappers
//
// At the first the user's file is entered, under the name that the user gave.
// At the second the user's declarations are complete: pipelines are found, one
// is read, and text with a wrapper for each of its phases is entered as if it
// were included there. Clang then generates code for what the wrappers use.
//
// The code is for nvptx64, because Clang passes aggregates there as they are;
// types have the host's layout, since that target copies it, and headers are
// the host's.
//
//===----------------------------------------------------------------------===//

#include "Parse.h"

#include "ClangDiagnostics.h"
#include "ClangInvocation.h"
#include "FillVariables.h"
#include "Wrappers.h"
#include "clang/AST/ASTConsumer.h"
#include "clang/AST/DeclTemplate.h"
#include "clang/Basic/DiagnosticSema.h"
#include "clang/Basic/TargetInfo.h"
#include "clang/CodeGen/ModuleBuilder.h"
#include "clang/Frontend/CompilerInstance.h"
#include "clang/Lex/Preprocessor.h"
#include "clang/Lex/PreprocessorOptions.h"
#include "clang/Parse/ParseAST.h"
#include "clang/Sema/Sema.h"
#include "llvm/Support/VirtualFileSystem.h"
#include "llvm/TargetParser/Host.h"
#include "llvm/TargetParser/Triple.h"

using namespace piko;
using llvm::failed;

static constexpr llvm::StringLiteral mainName = "<piko>";
static constexpr llvm::StringLiteral wrappersName = "<piko-wrappers>";

//===----------------------------------------------------------------------===//
// The invocation
//===----------------------------------------------------------------------===//

static std::shared_ptr<clang::CompilerInvocation>
makeInvocation(const ParseRequest &request,
               llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine> diagnostics) {
  const FrontendOptions &options = request.options;
  std::shared_ptr<clang::CompilerInvocation> invocation = createClangInvocation(
      {"-D__PIKO__=1", "-DNDEBUG=1", "-fno-exceptions", "-fno-rtti", "-O1",
       "-fwrapv", "-fno-finite-loops", "-fno-math-errno",
       "-fno-strict-aliasing", "-gline-tables-only", "-fno-access-control",
       "-Wno-undefined-internal", "-fno-strict-float-cast-overflow",
       "-fno-threadsafe-statics"},
      options, mainName, diagnostics);
  if (!invocation)
    return nullptr;

  // Headers see the host; code is generated for a target that keeps records
  // whole.
  llvm::Triple host(llvm::sys::getDefaultTargetTriple());
  clang::TargetOptions &target = invocation->getTargetOpts();
  target.HostTriple = host.str();
  target.Triple = "nvptx64-nvidia-cuda";
  target.CPU = "sm_90";
  target.TuneCPU.clear();
  target.ABI.clear();
  target.FeaturesAsWritten.clear();
  clang::PreprocessorOptions &preprocessor = invocation->getPreprocessorOpts();
  preprocessor.addMacroDef(host.isAArch64() ? "__aarch64__=1" : "__x86_64__=1");
  for (const char *macro : {"__linux__=1", "__gnu_linux__=1", "__unix__=1",
                            "_GNU_SOURCE=1", "__ELF__=1"})
    preprocessor.addMacroDef(macro);

  clang::CodeGenOptions &codeGen = invocation->getCodeGenOpts();
  codeGen.DisableLLVMPasses = true;
  codeGen.DisableLifetimeMarkers = !isChecking(options);
  // Errors name variables.
  codeGen.DiscardValueNames = false;
  // File names stay as given: Clang cuts off what they share with this folder.
  codeGen.DebugCompilationDir = "/";
  clang::LangOptions &language = invocation->getLangOpts();
  language.ThreadsafeStatics = false;
  return invocation;
}

//===----------------------------------------------------------------------===//
// Between the user's text and the wrappers
//===----------------------------------------------------------------------===//

namespace {

/// Includes the user's file, by the name that the user knows it by.
class FileReader : public clang::PragmaHandler {
public:
  explicit FileReader(llvm::StringRef file)
      : PragmaHandler("piko_file"), file(file) {}

  void HandlePragma(clang::Preprocessor &preprocessor, clang::PragmaIntroducer,
                    clang::Token &token) override {
    clang::SourceLocation here = token.getLocation();
    preprocessor.DiscardUntilEndOfDirective();
    clang::SourceManager &sources = preprocessor.getSourceManager();
    llvm::Expected<clang::FileEntryRef> entry =
        sources.getFileManager().getFileRef(file, /*OpenFile=*/true);
    if (!entry) {
      llvm::consumeError(entry.takeError());
      return;
    }
    // Clang expects to know the files that it looks up headers beside.
    preprocessor.getHeaderSearchInfo().getFileInfo(*entry);
    preprocessor.EnterSourceFile(
        sources.createFileID(*entry, here, clang::SrcMgr::C_User), nullptr,
        here);
  }

private:
  llvm::StringRef file;
};

/// Reads the pipeline when the parser comes to the pragma.
class UnitReader : public clang::PragmaHandler {
public:
  UnitReader(const ParseRequest &request, mlir::MLIRContext &context,
             clang::CompilerInstance &compiler,
             ClangDiagnosticForwarder &diagnostics, ParsedUnit &unit)
      : PragmaHandler("piko_wrappers"), request(request), context(context),
        compiler(compiler), diagnostics(diagnostics), unit(unit) {}

  void HandlePragma(clang::Preprocessor &preprocessor, clang::PragmaIntroducer,
                    clang::Token &token) override {
    clang::SourceLocation here = token.getLocation();
    preprocessor.DiscardUntilEndOfDirective();
    if (compiler.getDiagnostics().hasErrorOccurred())
      return;
    diagnostics.flush();
    std::string wrappers;
    ok = read(wrappers);
    if (!ok || wrappers.empty())
      return;
    clang::SourceManager &sources = compiler.getSourceManager();
    clang::FileID file = sources.createFileID(
        llvm::MemoryBuffer::getMemBufferCopy(wrappers, wrappersName),
        clang::SrcMgr::C_System, 0, 0, here);
    preprocessor.EnterSourceFile(file, nullptr, here);
  }

  bool succeeded() const { return ok; }
  RecordTable &getRecords() { return *records; }
  const PipelineReader &getReader() const { return *reader; }

private:
  bool read(std::string &wrappers) {
    clang::ASTContext &ast = compiler.getASTContext();
    std::vector<PipeCandidate> pipes = findPipes(compiler.getSema());
    for (const PipeCandidate &pipe : pipes)
      unit.pipes.push_back(pipe.name);
    if (request.goal == ParseGoal::ListPipes)
      return true;
    llvm::FailureOr<PipeCandidate> pipe = selectPipe(
        pipes, request.options.pipeName, unit.pipeline.location, ast, context);
    if (failed(pipe))
      return false;
    unit.pipeline.name = pipe->name;
    unit.pipeline.location =
        convertLocation(pipe->location, compiler.getSourceManager(), context);
    records.emplace(ast, context, unit.pipeline.records);
    reader.emplace(ast, context, unit.pipeline, *records);
    if (failed(reader->read(*pipe)))
      return false;
    unit.pipeline.typeName =
        records->getName(ast.getCanonicalTagType(pipe->type));
    wrappers = generateWrappers(unit.pipeline, unit.pipeline.typeName);
    return true;
  }

  const ParseRequest &request;
  mlir::MLIRContext &context;
  clang::CompilerInstance &compiler;
  ClangDiagnosticForwarder &diagnostics;
  ParsedUnit &unit;
  std::optional<RecordTable> records;
  std::optional<PipelineReader> reader;
  bool ok = false;
};

} // namespace

//===----------------------------------------------------------------------===//
// After the parse
//===----------------------------------------------------------------------===//

/// The marker that a function without a body is; none if it is not one.
static llvm::FailureOr<std::optional<Marker>>
readMarker(const clang::FunctionDecl *function, UnitReader &reader,
           ParsedUnit &unit) {
  const auto *space =
      llvm::dyn_cast<clang::NamespaceDecl>(function->getDeclContext());
  const auto *outer =
      space ? llvm::dyn_cast<clang::NamespaceDecl>(space->getParent())
            : nullptr;
  if (!outer || space->getName() != "marker" || outer->getName() != "piko")
    return std::optional<Marker>();
  std::optional<MarkerKind> kind = getMarkerKind(function->getName());
  if (!kind)
    return std::optional<Marker>();

  Marker marker{*kind};
  const clang::TemplateArgumentList *arguments =
      function->getTemplateSpecializationArgs();
  switch (*kind) {
  case MarkerKind::input:
  case MarkerKind::element:
  case MarkerKind::listAt:
  case MarkerKind::emit:
  case MarkerKind::updateBegin:
  case MarkerKind::updateEnd:
  case MarkerKind::reduceBegin:
  case MarkerKind::scanBegin:
  case MarkerKind::combineEnd:
  case MarkerKind::clear: {
    llvm::FailureOr<unsigned> record = reader.getRecords().get(
        (*arguments)[0].getAsType(), unit.pipeline.location);
    if (failed(record))
      return llvm::failure();
    marker.record = *record;
    break;
  }
  case MarkerKind::state:
    marker.offset =
        reader.getReader().getStateOffset((*arguments)[0].getAsType());
    break;
  case MarkerKind::sort:
    marker.isSigned = (*arguments)[0].getAsIntegral().getBoolValue();
    break;
  case MarkerKind::atomic:
  case MarkerKind::atomicFetch:
    marker.operation = (*arguments)[0].getAsIntegral().getSExtValue();
    marker.isSigned = (*arguments)[1].getAsIntegral().getBoolValue();
    break;
  case MarkerKind::endStage: {
    const clang::CXXRecordDecl *type =
        (*arguments)[0].getAsType()->getAsCXXRecordDecl();
    llvm::ArrayRef<const clang::CXXRecordDecl *> types =
        reader.getReader().stageTypes;
    for (auto [stage, candidate] : llvm::enumerate(types))
      if (type && candidate == type->getCanonicalDecl())
        marker.stages.push_back(stage);
    break;
  }
  default:
    break;
  }
  return std::optional<Marker>(marker);
}

static bool readFunctions(clang::CodeGenerator &generator, UnitReader &reader,
                          ParsedUnit &unit) {
  for (const llvm::Function &function : *unit.module) {
    if (function.isIntrinsic())
      continue;
    const auto *decl = llvm::dyn_cast_or_null<clang::FunctionDecl>(
        generator.GetDeclForMangledName(function.getName()));
    if (!decl)
      continue;
    if (function.isDeclaration()) {
      llvm::FailureOr<std::optional<Marker>> marker =
          readMarker(decl, reader, unit);
      if (failed(marker))
        return false;
      if (*marker) {
        unit.markers[function.getName().str()] = **marker;
        continue;
      }
    }
    unit.functionNames[function.getName().str()] =
        decl->getQualifiedNameAsString();
  }
  return true;
}

static void collectUserFiles(const clang::SourceManager &sources,
                             llvm::StringSet<> &files) {
  for (unsigned i = 0, e = sources.local_sloc_entry_size(); i != e; ++i) {
    const clang::SrcMgr::SLocEntry &entry = sources.getLocalSLocEntry(i);
    if (!entry.isFile() ||
        entry.getFile().getFileCharacteristic() != clang::SrcMgr::C_User)
      continue;
    llvm::StringRef name = entry.getFile().getName();
    if (name != mainName)
      files.insert(name);
  }
}

//===----------------------------------------------------------------------===//
// All of it
//===----------------------------------------------------------------------===//

std::unique_ptr<ParsedUnit> piko::parseUnit(const ParseRequest &request,
                                            mlir::MLIRContext &context) {
  mlir::Location fileLocation =
      mlir::FileLineColLoc::get(&context, request.file, 1, 1);
  auto memory = llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  auto files = llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(
      request.options.files ? request.options.files
                            : llvm::vfs::getRealFileSystem());
  files->pushOverlay(memory);
  if (request.text) {
    memory->addFile(request.file, 0,
                    llvm::MemoryBuffer::getMemBufferCopy(*request.text));
  } else if (!files->exists(request.file)) {
    mlir::emitError(fileLocation) << "cannot open the file";
    return nullptr;
  }

  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  auto driverDiagnostics = clang::CompilerInstance::createDiagnostics(
      *files, diagnosticOptions, &forwarder, /*ShouldOwnClient=*/false);
  std::shared_ptr<clang::CompilerInvocation> invocation =
      makeInvocation(request, driverDiagnostics);
  if (!invocation)
    return nullptr;
  invocation->getFrontendOpts().Inputs.clear();

  // Before Clang, which may still hold LLVM's module when it goes.
  auto unit = std::make_unique<ParsedUnit>(fileLocation);
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(files);
  compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
  if (!compiler.createTarget())
    return nullptr;
  compiler.createFileManager();
  compiler.createSourceManager();
  clang::SourceManager &sources = compiler.getSourceManager();
  sources.setMainFileID(sources.createFileID(llvm::MemoryBuffer::getMemBuffer(
      "#pragma piko_file\n;\n#pragma piko_wrappers\n", mainName)));

  compiler.createPreprocessor(clang::TU_Complete);
  clang::Preprocessor &preprocessor = compiler.getPreprocessor();
  preprocessor.getBuiltinInfo().initializeBuiltins(
      preprocessor.getIdentifierTable(), preprocessor.getLangOpts());
  UnitReader reader(request, context, compiler, forwarder, *unit);
  preprocessor.AddPragmaHandler(&reader);
  FileReader fileReader(request.file);
  preprocessor.AddPragmaHandler(&fileReader);
  compiler.createASTContext();

  bool compiles = request.goal != ParseGoal::ListPipes;
  unit->llvmContext = std::make_unique<llvm::LLVMContext>();
  clang::CodeGenerator *generator = nullptr;
  if (compiles) {
    auto consumer =
        clang::CreateLLVMCodeGen(compiler, request.file, *unit->llvmContext);
    generator = consumer.get();
    compiler.setASTConsumer(std::move(consumer));
  } else {
    compiler.setASTConsumer(std::make_unique<clang::ASTConsumer>());
  }
  compiler.getASTConsumer().Initialize(compiler.getASTContext());
  compiler.createSema(clang::TU_Complete, nullptr);

  forwarder.BeginSourceFile(compiler.getLangOpts(), &preprocessor);
  clang::ParseAST(compiler.getSema());
  forwarder.EndSourceFile();
  forwarder.flush();
  preprocessor.RemovePragmaHandler(&fileReader);
  preprocessor.RemovePragmaHandler(&reader);

  bool ok = !compiler.getDiagnostics().hasErrorOccurred() && reader.succeeded();
  if (ok && compiles) {
    unit->module = generator->ReleaseModule();
    ok = unit->module && readFunctions(*generator, reader, *unit);
    if (ok && isChecking(request.options))
      unit->module->addModuleFlag(llvm::Module::Override, checkingFlag, 1);
    collectUserFiles(sources, unit->userFiles);
  }
  if (!ok)
    return nullptr;
  return unit;
}
