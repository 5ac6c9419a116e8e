// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Programs.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Frontend/HostCompiler.h"
#include "Piko/Target/JIT.h"
#include "Piko/Target/Object.h"

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

std::shared_ptr<JITCode> load(llvm::Module &module, int optLevel,
                              Sanitizer sanitizer) {
  auto code =
      generateCode(module, {"native", optLevel, sanitizer}, CodeFormat::Object);
  if (!code)
    throw std::runtime_error(llvm::toString(code.takeError()));
  auto made = JITCode::load(*code);
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
  std::unique_ptr<PipelineFile> parse(const std::string &file,
                                      const std::string &pipe);
  void readText(const std::string &file, const std::string &pipe);
  void compileReference();

  MLIRContext context;
  Log log;
  std::string referenceFile;
  CheckOptions check;
  SynthesisOptions synthesis;
  GPUOptions gpu;
  std::unique_ptr<PipelineFile> file;
  /// Where the compiled file is `.mlir`: a module for each pipeline.
  std::vector<std::pair<std::string, OwningOpRef<ModuleOp>>> modules;
  std::vector<std::string> referenceNames;
  std::shared_ptr<JITCode> reference;
};

std::unique_ptr<PipelineFile>
Programs::Implementation::parse(const std::string &file,
                                const std::string &pipe) {
  CompileOptions options{.file = file, .pipeName = pipe, .check = check};
  std::unique_ptr<PipelineFile> parsed =
      PipelineFile::parse(file, getFrontendOptions(options), context);
  if (!parsed)
    log.fail("cannot load " + file);
  return parsed;
}

/// Divides the pipelines of an `.mlir` file.
void Programs::Implementation::readText(const std::string &file,
                                        const std::string &pipe) {
  CompileOptions options{.file = file, .pipeName = pipe, .check = check};
  FailureOr<std::vector<std::string>> names =
      readPipelineNames(options, context);
  if (failed(names))
    log.fail("cannot load " + file);
  for (const std::string &name : *names) {
    if (!pipe.empty() && name != pipe)
      continue;
    options.pipeName = name;
    modules.emplace_back(name, readPipeline(options, context));
  }
}

void Programs::Implementation::compileReference() {
  std::vector<PipelineDescription> described;
  for (size_t i = 0; i < file->size(); ++i) {
    FailureOr<PipelineDescription> description = file->describe(i);
    if (failed(description))
      continue;
    referenceNames.push_back(description->name);
    described.push_back(std::move(*description));
  }
  if (described.empty())
    log.fail("cannot load " + referenceFile);
  auto llvmContext = std::make_unique<llvm::LLVMContext>();
  // Its code is big and runs only once.
  std::unique_ptr<llvm::Module> module = compileForHost(
      generateReferenceAdapter(described, referenceFile),
      getFrontendOptions({.file = referenceFile, .check = {check.enabled, {}}}),
      /*optimize=*/false, *llvmContext, context);
  if (!module)
    log.fail("cannot compile " + referenceFile + " for the reference executor");
  reference = load(*module, /*optLevel=*/0, Sanitizer::None);
}

Programs::Programs(const std::string &file, const std::string &reference,
                   const std::string &pipe, const CheckOptions &check,
                   const SynthesisOptions &synthesis, const GPUOptions &gpu)
    : self(std::make_unique<Implementation>()) {
  self->referenceFile = reference;
  self->check = check;
  self->synthesis = synthesis;
  self->gpu = gpu;
  self->file = self->parse(reference, pipe);
  if (file != reference)
    self->readText(file, pipe);
  self->compileReference();
}

Programs::~Programs() = default;

std::vector<std::string> Programs::names() const {
  return self->referenceNames;
}

Program Programs::compile(const std::string &pipe) {
  OwningOpRef<ModuleOp> module;
  for (auto &[name, parsed] : self->modules)
    if (name == pipe)
      module = std::move(parsed);
  if (self->modules.empty())
    for (size_t i = 0; i < self->file->size(); ++i)
      if (self->file->getName(i) == pipe)
        module = self->file->translate(i);
  if (!module || failed(lowerPipeline(*module, Level::LLVM, self->check,
                                      self->synthesis, self->gpu)))
    self->log.fail("cannot compile " + pipe);
  auto context = std::make_unique<llvm::LLVMContext>();
  std::unique_ptr<llvm::Module> llvmModule =
      translateToLLVMIR(*module, *context);
  if (!llvmModule)
    self->log.fail("cannot compile " + pipe);
  std::shared_ptr<JITCode> code =
      load(*llvmModule, /*optLevel=*/3, JITCode::getSanitizer());
  auto name = std::make_shared<std::string>(pipe);
  Program program{{PIKORT_ABI_VERSION, name->c_str(),
                   find<void(pikort_pipeline *)>(*code, pipe + ".setup"),
                   find<int32_t(pikort_pipeline *)>(*code, pipe + ".run")},
                  nullptr};
  program.code = std::make_shared<
      std::pair<std::shared_ptr<std::string>, std::shared_ptr<JITCode>>>(name,
                                                                         code);
  return program;
}

Program Programs::reference(const std::string &pipe) {
  const std::vector<std::string> &names = self->referenceNames;
  auto found = std::find(names.begin(), names.end(), pipe);
  if (found == names.end())
    self->log.fail("cannot read " + pipe);
  auto *entry = find<const pikort_program *(int)>(*self->reference,
                                                  "piko_reference_program");
  return {*entry(int(found - names.begin())), self->reference};
}
