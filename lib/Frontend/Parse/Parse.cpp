//===- Parse.cpp - Running Clang on a pipeline's file ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// One parse does it all. The main buffer is ours:
//
//   #pragma piko_file
//   #pragma piko_wrappers
//
// (with a line before them, if a precompiled piko.h must hear of PIKO_TUNED).
// At the first the user's file is entered, under the name that the user gave.
// At the second the user's declarations are complete: pipelines are found, one
// or each is read, and text with a wrapper for each of its phases is entered as
// if it were included there. Clang then generates code for what the wrappers
// use; that of several pipelines is divided among their units.
//
// The text is parsed for this machine, whose headers are full of its builtins,
// registers and attributes. What they contain is not judged: exceptions and
// run-time type information are on, and what a phase may not call is found in
// the code of the phases. Only the calling convention is another machine's:
// nvptx64 passes aggregates as they are, where this machine's takes them apart
// and joins fields that have nothing to do with each other.
//
//===----------------------------------------------------------------------===//

#include "Parse/Parse.h"

#include "Cleanup/FillVariables.h"
#include "Parse/PhaseNames.h"
#include "Parse/Tunables.h"
#include "Parse/Wrappers.h"
#include "Clang/ClangDiagnostics.h"
#include "Clang/ClangInvocation.h"
#include "Clang/EvaluationOrder.h"
#include "Clang/HidingMacros.h"
#include "Clang/PrecompiledHeader.h"
#include "Clang/UnitModules.h"
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
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/Support/VirtualFileSystem.h"
#include "llvm/TargetParser/Triple.h"

using namespace piko;
using llvm::failed;

static constexpr llvm::StringLiteral mainName = "<piko>";
static constexpr llvm::StringLiteral headerPath = "/<piko-header>.pch";

//===----------------------------------------------------------------------===//
// The invocation
//===----------------------------------------------------------------------===//

static constexpr const char *clangFlags[] = {"-D__PIKO__=1",
                                             "-DNDEBUG=1",
                                             "-fignore-exceptions",
                                             "-fconstexpr-steps=33554432",
                                             "-O1",
                                             "-fwrapv",
                                             "-fno-finite-loops",
                                             "-fno-math-errno",
                                             "-fno-strict-aliasing",
                                             "-gline-tables-only",
                                             "-Wno-undefined-internal",
                                             "-fno-strict-float-cast-overflow",
                                             "-fno-threadsafe-statics"};

static std::shared_ptr<clang::CompilerInvocation>
makeInvocation(const FrontendOptions &options,
               llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine> diagnostics) {
  std::shared_ptr<clang::CompilerInvocation> invocation =
      createClangInvocation(clangFlags, options, mainName, diagnostics);
  if (!invocation)
    return nullptr;

  clang::CodeGenOptions &codeGen = invocation->getCodeGenOpts();
  codeGen.DisableLLVMPasses = true;
  codeGen.DisableLifetimeMarkers = !isChecking(options);
  // Errors name variables.
  codeGen.DiscardValueNames = false;
  // File names stay as given: Clang cuts off what they share with this folder.
  codeGen.DebugCompilationDir = "/";
  // A call of an alias would not show what it calls.
  codeGen.CXXCtorDtorAliases = false;
  clang::LangOptions &language = invocation->getLangOpts();
  language.ThreadsafeStatics = false;
  // Each operation on a _Float16 rounds.
  language.setFloat16ExcessPrecision(clang::LangOptions::FPP_None);
  language.setBFloat16ExcessPrecision(clang::LangOptions::FPP_None);
  return invocation;
}

/// Sets up code generation with the calling convention of a target that keeps
/// records whole, which is the only thing that it asks the triple for so early.
static void initializeConsumer(clang::CompilerInstance &compiler) {
  // No member of the target gives a way to change it.
  auto &triple = const_cast<llvm::Triple &>(compiler.getTarget().getTriple());
  llvm::Triple host =
      std::exchange(triple, llvm::Triple("nvptx64-nvidia-cuda"));
  compiler.getASTConsumer().Initialize(compiler.getASTContext());
  triple = std::move(host);
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

/// A pipeline that is being read.
struct UnitReader {
  UnitReader(mlir::Location file, clang::ASTContext &ast,
             mlir::MLIRContext &context)
      : unit(std::make_unique<ParsedUnit>(file)),
        records(ast, context, unit->pipeline.records),
        reader(ast, context, unit->pipeline, records) {}

  std::unique_ptr<ParsedUnit> unit;
  RecordTable records;
  PipelineReader reader;
  /// After the names of its wrappers.
  std::string suffix;
};

/// The user's macros are not for our text: directives that end those whose
/// names occur in it.
static std::string undefineMacros(llvm::StringRef text,
                                  clang::Preprocessor &preprocessor) {
  std::string directives;
  llvm::StringSet<> known;
  auto isPart = [](char c) { return llvm::isAlnum(c) || c == '_'; };
  while (!(text = text.drop_until(isPart)).empty()) {
    llvm::StringRef word = text.take_while(isPart);
    text = text.drop_front(word.size());
    if (known.insert(word).second && preprocessor.isMacroDefined(word))
      directives += ("#undef " + word + "\n").str();
  }
  return directives;
}

/// Reads the pipelines when the parser comes to the pragma.
class FileUnitsReader : public clang::PragmaHandler {
public:
  FileUnitsReader(const ParseRequest &request, mlir::Location fileLocation,
                  mlir::MLIRContext &context, clang::CompilerInstance &compiler,
                  ClangDiagnosticForwarder &diagnostics)
      : PragmaHandler("piko_wrappers"), request(request),
        fileLocation(fileLocation), context(context), compiler(compiler),
        diagnostics(diagnostics) {}

  void HandlePragma(clang::Preprocessor &preprocessor, clang::PragmaIntroducer,
                    clang::Token &token) override {
    clang::SourceLocation here = token.getLocation();
    preprocessor.DiscardUntilEndOfDirective();
    if (compiler.getDiagnostics().hasErrorOccurred())
      return;
    diagnostics.flush();
    if (failed(refuseHidingMacros(preprocessor, compiler.getASTContext(),
                                  context)))
      return;
    // Stages may be private.
    compiler.getLangOpts().AccessControl = false;
    std::string wrappers;
    ok = read(wrappers);
    if (!ok || wrappers.empty())
      return;
    wrappers = undefineMacros(wrappers, preprocessor) + wrappers;
    clang::SourceManager &sources = compiler.getSourceManager();
    clang::FileID file = sources.createFileID(
        llvm::MemoryBuffer::getMemBufferCopy(wrappers, wrappersName),
        clang::SrcMgr::C_System, 0, 0, here);
    preprocessor.EnterSourceFile(file, nullptr, here);
  }

  bool succeeded() const { return ok; }
  std::vector<std::string> pipes;
  std::vector<std::unique_ptr<UnitReader>> readers;

private:
  bool read(std::string &wrappers) {
    std::vector<PipeCandidate> candidates = findPipes(compiler.getSema());
    for (const PipeCandidate &pipe : candidates)
      pipes.push_back(pipe.name);
    switch (request.goal) {
    case ParseGoal::ListPipes:
    case ParseGoal::ListTunables:
      return true;
    case ParseGoal::CompilePipe: {
      llvm::FailureOr<PipeCandidate> pipe =
          selectPipe(candidates, request.options.pipeName, fileLocation,
                     compiler.getASTContext(), context);
      return llvm::succeeded(pipe) && read(*pipe, wrappers);
    }
    case ParseGoal::CompileAll:
      for (const PipeCandidate &pipe : candidates)
        (void)read(pipe, wrappers);
      return true;
    }
    llvm_unreachable("all goals are listed");
  }

  bool read(const PipeCandidate &pipe, std::string &wrappers) {
    clang::ASTContext &ast = compiler.getASTContext();
    auto made = std::make_unique<UnitReader>(fileLocation, ast, context);
    PipelineDescription &pipeline = made->unit->pipeline;
    pipeline.name = pipe.name;
    pipeline.location =
        convertLocation(pipe.location, compiler.getSourceManager(), context);
    PipelineReader &reader = made->reader;
    if (failed(reader.read(pipe)) ||
        failed(evaluateInitialValues(pipeline, reader.stateType,
                                     reader.stateMembers, compiler.getSema(),
                                     context)))
      return false;
    pipeline.typeName =
        made->records.getName(ast.getCanonicalTagType(pipe.type));
    made->suffix = "_of_" + std::to_string(readers.size());
    wrappers += generateWrappers(pipeline, pipeline.typeName, made->suffix,
                                 made->unit->wrappers);
    readers.push_back(std::move(made));
    return true;
  }

  const ParseRequest &request;
  mlir::Location fileLocation;
  mlir::MLIRContext &context;
  clang::CompilerInstance &compiler;
  ClangDiagnosticForwarder &diagnostics;
  bool ok = false;
};

} // namespace

//===----------------------------------------------------------------------===//
// After the parse
//===----------------------------------------------------------------------===//

/// The marker that a function without a body is; none if it is not one.
static llvm::FailureOr<std::optional<Marker>>
readMarker(const clang::FunctionDecl *function, UnitReader &reader) {
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
  case MarkerKind::expectIndex:
  case MarkerKind::clear: {
    llvm::FailureOr<unsigned> record = reader.records.get(
        (*arguments)[0].getAsType(), reader.unit->pipeline.location);
    if (failed(record))
      return llvm::failure();
    marker.record = *record;
    marker.isReadOnly = (*arguments)[0].getAsType().isConstQualified();
    if (*kind == MarkerKind::expectIndex)
      marker.isSigned = (*arguments)[1].getAsIntegral().getBoolValue();
    break;
  }
  case MarkerKind::state:
    marker.offset = reader.reader.getStateOffset((*arguments)[0].getAsType());
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
        reader.reader.stageTypes;
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

/// What a user calls a function. Template arguments, and the namespaces by
/// which a library tells its versions apart, say more than helps.
static std::string getUserName(const clang::FunctionDecl *function) {
  std::string name = function->getNameAsString();
  for (const clang::DeclContext *scope = function->getDeclContext(); scope;
       scope = scope->getParent()) {
    const auto *space = llvm::dyn_cast<clang::NamespaceDecl>(scope);
    const auto *named = llvm::dyn_cast<clang::NamedDecl>(scope);
    if (llvm::isa<clang::FunctionDecl>(scope))
      break;
    if (named && named->getDeclName() && !(space && space->isInline()))
      name = named->getNameAsString() + "::" + name;
  }
  return name;
}

static bool readFunctions(clang::CodeGenerator &generator, UnitReader &reader) {
  ParsedUnit &unit = *reader.unit;
  for (const llvm::Function &function : *unit.module) {
    if (function.isIntrinsic())
      continue;
    const auto *decl = llvm::dyn_cast_or_null<clang::FunctionDecl>(
        generator.GetDeclForMangledName(function.getName()));
    if (!decl)
      continue;
    if (function.isDeclaration()) {
      llvm::FailureOr<std::optional<Marker>> marker = readMarker(decl, reader);
      if (failed(marker))
        return false;
      if (*marker) {
        unit.markers[function.getName().str()] = **marker;
        continue;
      }
    }
    std::string name = getUserName(decl);
    if (const llvm::DISubprogram *program = function.getSubprogram())
      unit.programNames[program] = name;
    unit.functionNames[function.getName().str()] = std::move(name);
  }
  return true;
}

/// Warns about what is C++ and is hardly meant.
static void warnAboutText(clang::CodeGenerator &generator,
                          llvm::ArrayRef<std::unique_ptr<UnitReader>> readers,
                          clang::ASTContext &ast, mlir::MLIRContext &context) {
  llvm::SetVector<const clang::CXXRecordDecl *> stages;
  for (const std::unique_ptr<UnitReader> &reader : readers) {
    const PipelineDescription &pipeline = reader->unit->pipeline;
    for (auto [type, stage] :
         llvm::zip(reader->reader.stageTypes, pipeline.stages))
      if (stages.insert(type))
        warnAboutPhaseNames(type, pipeline.records[stage.input].name, ast,
                            context);
  }
  std::vector<const clang::FunctionDecl *> wrappers;
  for (const std::unique_ptr<UnitReader> &reader : readers)
    for (const auto &[name, wrapper] : reader->unit->wrappers)
      if (const auto *decl = llvm::dyn_cast_or_null<clang::FunctionDecl>(
              generator.GetDeclForMangledName(name + reader->suffix)))
        wrappers.push_back(decl);
  warnAboutEvaluationOrder(wrappers, ast, context);
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

/// Refuses what a shell has left of a string without its quotes.
static llvm::LogicalResult checkTuned(const FrontendOptions &options,
                                      mlir::Location file) {
  for (llvm::StringRef define : options.defines) {
    auto [name, value] = define.split('=');
    if (name == "PIKO_TUNED" && !value.starts_with("\""))
      return mlir::emitError(file) << "PIKO_TUNED: expected a string, such as "
                                      "-DPIKO_TUNED='\"name=value\"', but got '"
                                   << value << "'";
  }
  return llvm::success();
}

/// Refuses a name in PIKO_TUNED that is no tunable's.
static llvm::LogicalResult
checkTunedNames(const FrontendOptions &options,
                llvm::ArrayRef<TunableDescription> tunables,
                mlir::Location file) {
  for (llvm::StringRef define : options.defines)
    for (const TunedMacro &setting : readTunedMacro(define))
      if (llvm::none_of(tunables, [&](const TunableDescription &tunable) {
            return tunable.name == setting.name;
          }))
        return refuseTunable(setting.name, tunables, file);
  return llvm::success();
}

llvm::FailureOr<ParsedFile> piko::parseFile(const ParseRequest &request,
                                            mlir::MLIRContext &context) {
  mlir::Location fileLocation =
      mlir::FileLineColLoc::get(&context, request.file, 1, 1);
  if (failed(checkTuned(request.options, fileLocation)))
    return llvm::failure();
  auto memory = llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  auto files = llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(
      request.options.files ? request.options.files
                            : llvm::vfs::getRealFileSystem());
  files->pushOverlay(memory);
  if (request.text) {
    memory->addFile(request.file, 0,
                    llvm::MemoryBuffer::getMemBufferCopy(*request.text));
  } else {
    auto status = files->status(request.file);
    std::error_code problem = status.getError();
    if (status && status->isDirectory())
      problem = std::make_error_code(std::errc::is_a_directory);
    if (problem) {
      mlir::emitError(fileLocation)
          << "cannot open the file: " << problem.message();
      return llvm::failure();
    }
  }

  ClangDiagnosticForwarder forwarder(context);
  clang::DiagnosticOptions diagnosticOptions;
  auto driverDiagnostics = clang::CompilerInstance::createDiagnostics(
      *files, diagnosticOptions, &forwarder, /*ShouldOwnClient=*/false);
  std::shared_ptr<clang::CompilerInvocation> invocation =
      makeInvocation(request.options, driverDiagnostics);
  if (!invocation)
    return llvm::failure();
  invocation->getFrontendOpts().Inputs.clear();

  std::unique_ptr<llvm::MemoryBuffer> header = getPrecompiledHeader(
      request.file, request.options, clangFlags, files, makeInvocation);
  bool hasHeader = header != nullptr;
  if (hasHeader)
    memory->addFile(headerPath, 0, std::move(header));

  // Before Clang, which may still hold LLVM's module when it goes.
  auto llvmContext = std::make_shared<llvm::LLVMContext>();
  clang::CompilerInstance compiler(invocation);
  compiler.setVirtualFileSystem(files);
  compiler.createDiagnostics(&forwarder, /*ShouldOwnClient=*/false);
  if (!compiler.createTarget())
    return llvm::failure();
  compiler.createFileManager();
  compiler.createSourceManager();
  clang::SourceManager &sources = compiler.getSourceManager();
  std::string mainText = hasHeader ? getTextAfterHeader(request.options) : "";
  mainText += "#pragma piko_file\n;\n#pragma piko_wrappers\n";
  sources.setMainFileID(sources.createFileID(
      llvm::MemoryBuffer::getMemBuffer(mainText, mainName)));

  compiler.createPreprocessor(clang::TU_Complete);
  clang::Preprocessor &preprocessor = compiler.getPreprocessor();
  if (!hasHeader)
    preprocessor.getBuiltinInfo().initializeBuiltins(
        preprocessor.getIdentifierTable(), preprocessor.getLangOpts());
  FileUnitsReader reader(request, fileLocation, context, compiler, forwarder);
  preprocessor.AddPragmaHandler(&reader);
  FileReader fileReader(request.file);
  preprocessor.AddPragmaHandler(&fileReader);
  compiler.createASTContext();

  bool compiles = request.goal == ParseGoal::CompilePipe ||
                  request.goal == ParseGoal::CompileAll;
  clang::CodeGenerator *generator = nullptr;
  if (compiles) {
    auto consumer =
        clang::CreateLLVMCodeGen(compiler, request.file, *llvmContext);
    generator = consumer.get();
    compiler.setASTConsumer(std::move(consumer));
  } else {
    compiler.setASTConsumer(std::make_unique<clang::ASTConsumer>());
  }
  if (hasHeader)
    compiler.createPCHExternalASTSource(
        headerPath, clang::DisableValidationForModuleKind::All,
        /*AllowPCHWithCompilerErrors=*/false,
        compiler.getASTConsumer().GetASTDeserializationListener(),
        /*OwnDeserializationListener=*/false);
  initializeConsumer(compiler);
  compiler.createSema(clang::TU_Complete, nullptr);
  forwarder.setSema(&compiler.getSema());

  forwarder.BeginSourceFile(compiler.getLangOpts(), &preprocessor);
  clang::ParseAST(compiler.getSema());
  forwarder.EndSourceFile();
  forwarder.flush();
  preprocessor.RemovePragmaHandler(&fileReader);
  preprocessor.RemovePragmaHandler(&reader);

  if (compiler.getDiagnostics().hasErrorOccurred() || !reader.succeeded())
    return llvm::failure();
  ParsedFile result;
  result.pipes = std::move(reader.pipes);
  if (request.goal == ParseGoal::ListTunables || isTuned(request.options)) {
    auto tunables = findTunables(compiler.getASTContext(), context);
    if (failed(tunables) ||
        failed(checkTunedNames(request.options, *tunables, fileLocation)))
      return llvm::failure();
    result.tunables = std::move(*tunables);
  }
  if (!compiles)
    return result;
  std::unique_ptr<llvm::Module> module(generator->ReleaseModule());
  if (!module)
    return llvm::failure();
  adaptModule(*module);
  warnAboutText(*generator, reader.readers, compiler.getASTContext(), context);
  llvm::StringSet<> userFiles;
  collectUserFiles(sources, userFiles);
  for (std::unique_ptr<UnitReader> &made : reader.readers) {
    ParsedUnit &unit = *made->unit;
    unit.llvmContext = llvmContext;
    unit.userFiles = userFiles;
    unit.module = reader.readers.size() == 1
                      ? std::move(module)
                      : extractUnit(*module, made->suffix);
    dropSuffix(*unit.module, made->suffix);
    if (isChecking(request.options))
      unit.module->addModuleFlag(llvm::Module::Override, checkingFlag, 1);
    if (readFunctions(*generator, *made))
      result.units.push_back(std::move(made->unit));
    else if (request.goal == ParseGoal::CompilePipe)
      return llvm::failure();
  }
  return result;
}
