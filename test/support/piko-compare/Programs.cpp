// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Programs.h"

#include "Cache/SourceCache.h"
#include "ObjectRequest.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Target/JIT.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/Processor.h"
#include "ReferenceObject.h"
#include "Report.h"
#include "mlir/Bytecode/BytecodeWriter.h"
#include "mlir/Parser/Parser.h"

#include <map>
#include <stdexcept>

using namespace mlir;
using namespace piko;

namespace {

/// Shows what diagnostics there were since the last error.
class Log {
public:
  explicit Log(MLIRContext &context) : stream(text), printer(context, stream) {}
  [[noreturn]] void fail(const std::string &what) {
    std::string diagnostics = std::move(text);
    text.clear();
    throw NotCompiled(what, diagnostics);
  }

private:
  std::string text;
  llvm::raw_string_ostream stream;
  DiagnosticPrinter printer;
};

std::shared_ptr<JITCode> load(llvm::ArrayRef<llvm::StringRef> objects) {
  auto made = JITCode::load(objects);
  if (!made)
    throw std::runtime_error(llvm::toString(made.takeError()));
  return std::move(*made);
}

template <class F> F *find(JITCode &code, const std::string &name) {
  auto found = code.lookup<F>(name);
  if (!found)
    throw std::runtime_error(llvm::toString(found.takeError()));
  return *found;
}

} // namespace

struct Programs::Implementation {
  explicit Implementation(const Options &options)
      : options(options), log(context), kept(options.cache) {
    context.loadAllAvailableDialects();
  }
  void compileReference(const std::string &file);
  void readText(const std::string &file);
  std::vector<PipelineDescription>
  describeAll(const llvm::IntrusiveRefCntPtr<SourceRecorder> &files,
              std::string &diagnostics);
  void translateAll();
  CompileOptions getSource(const std::string &pipe) const;
  std::string makeAuthoredRequest(const std::string &pipe) const;
  void keepAuthored(const std::string &pipe, ModuleOp module);
  OwningOpRef<ModuleOp> parse(const std::string &pipe);
  OwningOpRef<ModuleOp> load(const std::string &pipe);
  ModuleOp read(const std::string &pipe);
  CompiledPipeline compile(const std::string &pipe, const ObjectOptions &object,
                           const Processor &processor);
  CompiledPipeline find(const std::string &pipe, const Target &target);

  const Options &options;
  PikoContext context;
  Log log;
  /// The only pipeline that is wanted; empty = all.
  std::string onlyPipe;
  /// What was compiled before.
  SourceCache kept;
  /// What reading the file asks.
  llvm::IntrusiveRefCntPtr<SourceRecorder> recorder =
      llvm::makeIntrusiveRefCnt<SourceRecorder>(llvm::vfs::getRealFileSystem());
  /// Where the compiled file is C++, once it is needed.
  std::unique_ptr<PipelineFile> file;
  /// Where the compiled file is `.mlir`: a module for each pipeline.
  std::vector<std::pair<std::string, OwningOpRef<ModuleOp>>> modules;
  /// What was read of the pipelines, null after diagnostics.
  std::map<std::string, OwningOpRef<ModuleOp>> authored;
  std::optional<CompiledObject> referenceObject;
  std::string referenceDiagnostics;
  std::shared_ptr<JITCode> reference;
};

/// Of a module as it is written.
static bool isStrict(ModuleOp module) {
  return !module
              .walk([](ProcessOp process) {
                Precision precision =
                    process.getPrecision().value_or(Precision::Strict);
                return precision == Precision::Strict && !process.getUlps()
                           ? WalkResult::advance()
                           : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Divides the pipelines of an `.mlir` file.
void Programs::Implementation::readText(const std::string &file) {
  CompileOptions source{
      .file = file, .pipeName = onlyPipe, .check = options.check};
  FailureOr<std::vector<std::string>> names =
      readPipelineNames(source, context);
  if (failed(names))
    log.fail("cannot load " + file);
  for (const std::string &name : *names) {
    if (!onlyPipe.empty() && name != onlyPipe)
      continue;
    source.pipeName = name;
    modules.emplace_back(name, readPipeline(source, context, recorder));
  }
}

CompileOptions
Programs::Implementation::getSource(const std::string &pipe) const {
  return {.file = options.file,
          .pipeName = pipe,
          .check = options.check,
          .cache = options.cache};
}

/// What leads to a pipeline as it is written.
std::string
Programs::Implementation::makeAuthoredRequest(const std::string &pipe) const {
  return makeObjectRequest(
      {.source = getSource(pipe), .nameSpace = "piko-compare authored"}, {},
      *recorder, CompilerPart::Frontend);
}

void Programs::Implementation::keepAuthored(const std::string &pipe,
                                            ModuleOp module) {
  std::string bytes;
  llvm::raw_string_ostream stream(bytes);
  // Where it cannot be kept it is parsed again.
  if (succeeded(writeBytecodeToFile(module, stream)))
    llvm::consumeError(kept.keep(makeAuthoredRequest(pipe), *recorder, bytes));
}

/// Parses the file for its reference executor and for what is compiled of it, now
/// and by the next ones to ask.
std::vector<PipelineDescription> Programs::Implementation::describeAll(
    const llvm::IntrusiveRefCntPtr<SourceRecorder> &files,
    std::string &diagnostics) {
  recorder = files;
  llvm::raw_string_ostream stream(diagnostics);
  DiagnosticPrinter printer(context, stream);
  FrontendOptions frontend = getFrontendOptions(getSource(""));
  frontend.files = recorder;
  file = PipelineFile::parse(options.file, frontend, context);
  std::vector<PipelineDescription> pipelines;
  for (size_t i = 0; file && i < file->size(); ++i)
    if (FailureOr<PipelineDescription> pipeline = file->describe(i);
        succeeded(pipeline))
      pipelines.push_back(std::move(*pipeline));
  if (file && kept.isEnabled())
    translateAll();
  return pipelines;
}

/// Keeps all pipelines of the file as they are written.
void Programs::Implementation::translateAll() {
  // Who asks for a pipeline with errors reads it again, and shows them.
  ScopedDiagnosticHandler handler(&context,
                                  [](Diagnostic &) { return success(); });
  for (size_t i = 0; i < file->size(); ++i)
    if (OwningOpRef<ModuleOp> module = file->translate(i))
      keepAuthored(file->getName(i).str(), *module);
  file.reset();
}

/// All pipelines of the file, which then need to be compiled only once however
/// often they are compared. That code is big and runs only once.
void Programs::Implementation::compileReference(const std::string &file) {
  ObjectOptions object{.source = {.file = file,
                                  .check = {options.check.enabled, {}},
                                  .cache = options.cache},
                       .execution = ExecutionTarget::Reference,
                       .target = {"native", /*optLevel=*/0, Sanitizer::None},
                       .allPipelines = true};
  PipelineDescriber describe = nullptr;
  if (file == options.file)
    describe = [this](const auto &files, std::string &diagnostics) {
      return describeAll(files, diagnostics);
    };
  referenceObject =
      compileReferenceObject(object, referenceDiagnostics, describe);
  if (!referenceObject)
    throw NotCompiled("cannot compile " + file + " for the reference executor",
                      referenceDiagnostics);
  reference = ::load({referenceObject->code, referenceObject->headerCode});
}

/// The module of a pipeline as its text says it; null after diagnostics.
OwningOpRef<ModuleOp> Programs::Implementation::parse(const std::string &pipe) {
  for (auto &[name, parsed] : modules)
    if (name == pipe)
      return std::move(parsed);
  if (!modules.empty())
    return nullptr;
  if (!file) {
    FrontendOptions frontend = getFrontendOptions(getSource(onlyPipe));
    frontend.files = recorder;
    file = PipelineFile::parse(options.file, frontend, context);
  }
  for (size_t i = 0; file && i < file->size(); ++i)
    if (file->getName(i) == pipe)
      return file->translate(i);
  return nullptr;
}

/// The module of a pipeline, parsed unless another process did so before; null
/// after diagnostics.
OwningOpRef<ModuleOp> Programs::Implementation::load(const std::string &pipe) {
  if (!kept.isEnabled() || !modules.empty())
    return parse(pipe);
  if (std::unique_ptr<llvm::MemoryBuffer> found =
          kept.lookUp(makeAuthoredRequest(pipe), *recorder))
    return parseSourceString<ModuleOp>(found->getBuffer(), &context);
  OwningOpRef<ModuleOp> module = parse(pipe);
  if (module)
    keepAuthored(pipe, *module);
  return module;
}

/// The module of a pipeline as it is written, of which each target gets a copy;
/// null after diagnostics.
ModuleOp Programs::Implementation::read(const std::string &pipe) {
  auto [found, isNew] = authored.try_emplace(pipe);
  if (isNew)
    found->second = load(pipe);
  return found->second ? *found->second : ModuleOp();
}

Programs::Programs(const Options &options)
    : self(std::make_unique<Implementation>(options)) {
  if (options.cases.empty())
    self->onlyPipe = options.one.pipe;
  self->compileReference(options.reference);
  if (options.file != options.reference)
    self->readText(options.file);
}

Programs::~Programs() = default;

std::vector<std::string> Programs::names() const {
  return self->referenceObject->pipelines;
}

CompiledPipeline Programs::Implementation::compile(const std::string &pipe,
                                                   const ObjectOptions &object,
                                                   const Processor &processor) {
  ModuleOp written = read(pipe);
  OwningOpRef<ModuleOp> module = written ? written.clone() : ModuleOp();
  const GPUOptions &gpu = object.source.gpu;
  if (!module || failed(lowerPipeline(*module, Level::LLVM, options.check,
                                      object.source.synthesis, gpu,
                                      {.lanes = processor.lanes})))
    log.fail("cannot compile " + pipe);
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> llvmModule =
      translateToLLVMIR(*module, llvmContext, gpu);
  if (!llvmModule)
    log.fail("cannot compile " + pipe);
  llvm::Expected<std::string> code =
      generateCode(*llvmModule, object.target, CodeFormat::Object);
  if (!code)
    throw std::runtime_error(llvm::toString(code.takeError()));
  return {std::move(*code), isStrict(written)};
}

/// Throws if this machine cannot run code for a processor.
static void checkMachine(const Processor &processor) {
  llvm::Expected<Processor> machine = resolveProcessor("native");
  if (!machine)
    throw std::runtime_error(llvm::toString(machine.takeError()));
  for (llvm::StringRef need : processor.needs)
    if (!llvm::is_contained(machine->needs, need))
      throw std::runtime_error("this machine does not run code for " +
                               processor.name + ", which needs " + need.str());
}

/// Compiles unless that was done before.
CompiledPipeline Programs::Implementation::find(const std::string &pipe,
                                                const Target &target) {
  llvm::Expected<Processor> processor =
      resolveProcessor(target.cpu, llvm::cantFail(resolveTriple(target.arch)));
  if (!processor)
    throw std::runtime_error(llvm::toString(processor.takeError()));
  TargetOptions machine{target.cpu, options.getOptLevel(target)};
  machine.arch = target.arch;
  if (target.arch.empty()) {
    checkMachine(*processor);
    machine.sanitizer = JITCode::getSanitizer();
  }
  ObjectOptions object{
      .source = {.file = options.file,
                 .pipeName = pipe,
                 .check = options.check,
                 .synthesis = machine.leaveOutUnseen(options.synthesis),
                 .gpu = target.gpu},
      .target = machine,
      .nameSpace = "piko-compare"};
  if (!kept.isEnabled())
    return compile(pipe, object, *processor);
  std::string request = makeObjectRequest(object, *processor, *recorder);
  llvm::vfs::FileSystem &disk = *llvm::vfs::getRealFileSystem();
  if (std::unique_ptr<llvm::MemoryBuffer> found = kept.lookUp(request, disk)) {
    StringReader reader(found->getBuffer());
    std::string code = reader.next();
    return {std::move(code), reader.next() == "strict"};
  }
  CompiledPipeline made = compile(pipe, object, *processor);
  StringWriter writer;
  writer.add(made.code).add(made.isStrict ? "strict" : "");
  // Where it cannot be kept it is made again.
  llvm::consumeError(kept.keep(request, *recorder, writer.bytes));
  return made;
}

Program Programs::compile(const std::string &pipe, const Target &target) {
  CompiledPipeline compiled = self->find(pipe, target);
  std::shared_ptr<JITCode> code = load(llvm::StringRef(compiled.code));
  auto name = std::make_shared<std::string>(pipe);
  Program program{{PIKORT_ABI_VERSION, name->c_str(),
                   find<void(pikort_pipeline *)>(*code, pipe + ".setup"),
                   find<int32_t(pikort_pipeline *)>(*code, pipe + ".run")},
                  nullptr,
                  compiled.isStrict};
  program.code = std::make_shared<
      std::pair<std::shared_ptr<std::string>, std::shared_ptr<JITCode>>>(name,
                                                                         code);
  return program;
}

CompiledPipeline Programs::compileObject(const std::string &pipe,
                                         const Target &target) {
  return self->find(pipe, target);
}

Program Programs::reference(const std::string &pipe) {
  const std::vector<std::string> &names = self->referenceObject->pipelines;
  auto found = std::find(names.begin(), names.end(), pipe);
  if (found == names.end())
    throw NotCompiled("cannot read " + pipe + "; expected one of " +
                          joinNames(names),
                      self->referenceDiagnostics);
  auto *entry = find<const pikort_program *(int)>(*self->reference,
                                                  "piko_reference_program");
  return {*entry(int(found - names.begin())), self->reference, true};
}
