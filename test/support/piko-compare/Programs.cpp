// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Programs.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Target/JIT.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/Processor.h"

#include <stdexcept>

using namespace mlir;
using namespace piko;

namespace {

/// Shows what diagnostics there were since the last error.
class Log {
public:
  explicit Log(MLIRContext &context) : stream(text), printer(context, stream) {}
  [[noreturn]] void fail(const std::string &what) {
    std::string message = what + "\n" + text;
    text.clear();
    throw std::runtime_error(message);
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
  Implementation() : context(makeRegistry()), log(context) {
    context.loadAllAvailableDialects();
  }
  static DialectRegistry makeRegistry() {
    DialectRegistry registry;
    registerPikoDialects(registry);
    return registry;
  }
  void compileReference(const std::string &file);
  void readText(const std::string &file);
  OwningOpRef<ModuleOp> read(const std::string &pipe);

  MLIRContext context;
  Log log;
  std::string sourceFile;
  /// The only pipeline that is wanted; empty = all.
  std::string onlyPipe;
  CheckOptions check;
  CacheOptions cache;
  SynthesisOptions synthesis;
  GPUOptions gpu;
  std::string cpu;
  /// Where the compiled file is C++, once it is needed.
  std::unique_ptr<PipelineFile> file;
  /// Where the compiled file is `.mlir`: a module for each pipeline.
  std::vector<std::pair<std::string, OwningOpRef<ModuleOp>>> modules;
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
                return precision == Precision::Strict ? WalkResult::advance()
                                                      : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Divides the pipelines of an `.mlir` file.
void Programs::Implementation::readText(const std::string &file) {
  CompileOptions options{.file = file, .pipeName = onlyPipe, .check = check};
  FailureOr<std::vector<std::string>> names =
      readPipelineNames(options, context);
  if (failed(names))
    log.fail("cannot load " + file);
  for (const std::string &name : *names) {
    if (!onlyPipe.empty() && name != onlyPipe)
      continue;
    options.pipeName = name;
    modules.emplace_back(name, readPipeline(options, context));
  }
}

/// All pipelines of the file, which then need to be compiled only once however
/// often they are compared. That code is big and runs only once.
void Programs::Implementation::compileReference(const std::string &file) {
  ObjectOptions options{
      .source = {.file = file, .check = {check.enabled, {}}, .cache = cache},
      .execution = ExecutionTarget::Reference,
      .target = {"native", /*optLevel=*/0, Sanitizer::None},
      .allPipelines = true};
  referenceObject = compileObject(options, referenceDiagnostics);
  if (!referenceObject)
    throw std::runtime_error("cannot compile " + file +
                             " for the reference executor\n" +
                             referenceDiagnostics);
  reference = load({referenceObject->code, referenceObject->headerCode});
}

/// The module of a pipeline; null after diagnostics.
OwningOpRef<ModuleOp> Programs::Implementation::read(const std::string &pipe) {
  for (auto &[name, parsed] : modules)
    if (name == pipe)
      return std::move(parsed);
  if (!modules.empty())
    return nullptr;
  CompileOptions options{
      .file = sourceFile, .pipeName = onlyPipe, .check = check, .cache = cache};
  if (!file)
    file =
        PipelineFile::parse(sourceFile, getFrontendOptions(options), context);
  for (size_t i = 0; file && i < file->size(); ++i)
    if (file->getName(i) == pipe)
      return file->translate(i);
  return nullptr;
}

Programs::Programs(const Options &options)
    : self(std::make_unique<Implementation>()) {
  self->sourceFile = options.file;
  if (options.cases.empty())
    self->onlyPipe = options.one.pipe;
  self->check = options.check;
  self->cache = options.cache;
  self->synthesis = options.synthesis;
  self->gpu = options.gpu;
  self->cpu = options.cpu;
  self->compileReference(options.reference);
  if (options.file != options.reference)
    self->readText(options.file);
}

Programs::~Programs() = default;

std::vector<std::string> Programs::names() const {
  return self->referenceObject->pipelines;
}

Program Programs::compile(const std::string &pipe) {
  OwningOpRef<ModuleOp> module = self->read(pipe);
  bool strict = module && isStrict(*module);
  llvm::Expected<Processor> processor = resolveProcessor(self->cpu);
  if (!processor)
    throw std::runtime_error(llvm::toString(processor.takeError()));
  TargetOptions target{self->cpu, /*optLevel=*/3, JITCode::getSanitizer()};
  if (!module || failed(lowerPipeline(*module, Level::LLVM, self->check,
                                      target.leaveOutUnseen(self->synthesis),
                                      self->gpu, {.lanes = processor->lanes})))
    self->log.fail("cannot compile " + pipe);
  auto context = std::make_unique<llvm::LLVMContext>();
  std::unique_ptr<llvm::Module> llvmModule =
      translateToLLVMIR(*module, *context, self->gpu);
  if (!llvmModule)
    self->log.fail("cannot compile " + pipe);
  llvm::Expected<std::string> object =
      generateCode(*llvmModule, target, CodeFormat::Object);
  if (!object)
    throw std::runtime_error(llvm::toString(object.takeError()));
  std::shared_ptr<JITCode> code = load(llvm::StringRef(*object));
  auto name = std::make_shared<std::string>(pipe);
  Program program{{PIKORT_ABI_VERSION, name->c_str(),
                   find<void(pikort_pipeline *)>(*code, pipe + ".setup"),
                   find<int32_t(pikort_pipeline *)>(*code, pipe + ".run")},
                  nullptr,
                  strict};
  program.code = std::make_shared<
      std::pair<std::shared_ptr<std::string>, std::shared_ptr<JITCode>>>(name,
                                                                         code);
  return program;
}

Program Programs::reference(const std::string &pipe) {
  const std::vector<std::string> &names = self->referenceObject->pipelines;
  auto found = std::find(names.begin(), names.end(), pipe);
  if (found == names.end())
    throw std::runtime_error("cannot read " + pipe + "\n" +
                             self->referenceDiagnostics);
  auto *entry = find<const pikort_program *(int)>(*self->reference,
                                                  "piko_reference_program");
  return {*entry(int(found - names.begin())), self->reference, true};
}
