// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's text to an object file, through the cache.

#include "Piko/Driver/ObjectCompiler.h"

#include "HeaderWriter.h"
#include "ObjectRequest.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Frontend/HostCompiler.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/Versions.h"
#include "SourceCache.h"

#include "llvm/Support/Path.h"
#include "llvm/TargetParser/Host.h"
#include "llvm/Transforms/IPO/Internalize.h"

#include "Piko/Analysis/LinearFacts.h"
#include "pikort/pikort.h"

using namespace mlir;
using namespace piko;

static_assert(maxDomainExtent == PIKORT_MAX_EXTENT);

using Files = llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem>;

static const char *const referenceEntry = "piko_reference_program";

namespace {

/// An object and what was said when it was made.
struct Entry {
  CompiledObject object;
  /// Whether there is to be code of piko.h, which is kept apart.
  bool needsHeader = false;
  std::string diagnostics;
};

} // namespace

//===----------------------------------------------------------------------===//
// Entries of the cache
//===----------------------------------------------------------------------===//

static std::string writeEntry(const Entry &entry) {
  StringWriter writer;
  const CompiledObject &object = entry.object;
  writer.add(object.symbol).add(object.code).add(object.header);
  writer.add(entry.diagnostics).add(entry.needsHeader ? "header" : "");
  writer.add(std::to_string(object.pipelines.size()));
  for (const auto *list : {&object.pipelines, &object.files})
    for (const std::string &item : *list)
      writer.add(item);
  return writer.bytes;
}

static Entry readEntry(llvm::StringRef bytes) {
  StringReader reader(bytes);
  Entry entry;
  for (std::string *part : {&entry.object.symbol, &entry.object.code,
                            &entry.object.header, &entry.diagnostics})
    *part = reader.next();
  entry.needsHeader = !reader.next().empty();
  size_t pipelines = 0;
  llvm::to_integer(reader.next(), pipelines);
  while (!reader.atEnd() && entry.object.pipelines.size() < pipelines)
    entry.object.pipelines.push_back(reader.next());
  while (!reader.atEnd())
    entry.object.files.push_back(reader.next());
  return entry;
}

//===----------------------------------------------------------------------===//
// Compiling
//===----------------------------------------------------------------------===//

/// A module at Level::LLVM for each processor, in LLVM IR; none after
/// diagnostics. Processors with as many lanes have the same.
static std::vector<std::unique_ptr<llvm::Module>>
translateForEach(ModuleOp module, llvm::ArrayRef<Processor> processors,
                 const CompileOptions &source, int optLevel,
                 llvm::LLVMContext &context) {
  llvm::SmallVector<CPUOptions> cpus;
  llvm::SmallDenseMap<int64_t, size_t> places; // by lanes
  for (const Processor &processor : processors)
    if (places.try_emplace(processor.lanes, cpus.size()).second)
      cpus.push_back({.lanes = processor.lanes});
  llvm::SmallVector<OwningOpRef<ModuleOp>> lowered =
      lowerForEach(cpus, module, source.check, source.synthesis, source.gpu);
  std::vector<std::unique_ptr<llvm::Module>> translated;
  if (lowered.empty())
    return translated;
  for (const Processor &processor : processors) {
    translated.push_back(translateToLLVMIR(*lowered[places[processor.lanes]],
                                           context, source.gpu, optLevel));
    if (!translated.back())
      return {};
  }
  return translated;
}

/// Of --target auto: adds code for a device. A pipeline that none can run goes
/// without it, and a warning says why.
static void addDeviceVersion(ModuleOp module, const ObjectOptions &options,
                             std::vector<Processor> &processors,
                             std::vector<std::unique_ptr<llvm::Module>> &parts,
                             llvm::LLVMContext &context) {
  CompileOptions source = options.source;
  source.gpu.target = GPUTarget::CUDA;
  std::string reason;
  Location place = module.getLoc();
  std::vector<std::unique_ptr<llvm::Module>> translated;
  {
    ScopedDiagnosticHandler handler(
        module.getContext(), [&](Diagnostic &diagnostic) {
          if (diagnostic.getSeverity() != DiagnosticSeverity::Error)
            return failure();
          if (reason.empty()) {
            reason = diagnostic.str();
            place = diagnostic.getLocation();
          }
          return success();
        });
    translated = translateForEach(module, processors.front(), source,
                                  options.target.optLevel, context);
  }
  if (translated.empty()) {
    emitWarning(place) << "no code for a GPU: " << reason;
    return;
  }
  Processor host = processors.front();
  host.device = "cuda";
  host.needs.push_back("cuda");
  processors.push_back(std::move(host));
  parts.push_back(std::move(translated.front()));
}

/// LLVM IR of the compiled pipeline; null after diagnostics.
static std::unique_ptr<llvm::Module>
compilePipeline(const ObjectOptions &options, std::vector<Processor> processors,
                const Files &files, MLIRContext &context,
                llvm::LLVMContext &llvmContext, CompiledObject &object) {
  OwningOpRef<ModuleOp> module = readPipeline(options.source, context, files);
  if (!module)
    return nullptr;
  std::string name = getPipelineName(*module, options.source);
  object.pipelines = {name};
  for (auto pipeline : module->getOps<PipelineOp>())
    object.header =
        writeHostHeader(pipeline, options.source.file, options.nameSpace);
  object.symbol = getProgramSymbol(options.nameSpace, name);
  CompileOptions source = options.source;
  OwningOpRef<ModuleOp> copy;
  if (source.gpu.target == GPUTarget::Auto) {
    source.gpu.target = GPUTarget::None;
    copy = module->clone();
  }
  std::vector<std::unique_ptr<llvm::Module>> translated = translateForEach(
      *module, processors, source, options.target.optLevel, llvmContext);
  if (translated.empty())
    return nullptr;
  if (copy)
    addDeviceVersion(*copy, options, processors, translated, llvmContext);
  return defineProgram(std::move(translated), name, object.symbol, processors);
}

/// What the reference executor shall run; empty after diagnostics.
static std::vector<PipelineDescription>
describePipelines(const ObjectOptions &options, FrontendOptions frontend,
                  MLIRContext &context, std::string &diagnostics) {
  if (options.allPipelines && options.describeAll)
    return options.describeAll(diagnostics);
  const std::string &name = options.source.file;
  std::vector<PipelineDescription> pipelines;
  auto add = [&](FailureOr<PipelineDescription> pipeline) {
    if (succeeded(pipeline))
      pipelines.push_back(std::move(*pipeline));
  };
  if (!options.allPipelines) {
    add(describePipe(name, frontend, context));
    return pipelines;
  }
  frontend.pipeName.clear();
  if (auto file = PipelineFile::parse(name, frontend, context))
    for (size_t i = 0; i < file->size(); ++i)
      add(file->describe(i));
  return pipelines;
}

/// LLVM IR of the reference executor; null after diagnostics.
static std::unique_ptr<llvm::Module>
compileReference(const ObjectOptions &options, const Files &files,
                 MLIRContext &context, llvm::LLVMContext &llvmContext,
                 Entry &entry) {
  CompiledObject &object = entry.object;
  const std::string &file = options.source.file;
  if (llvm::StringRef(file).ends_with(".mlir")) {
    emitError(FileLineColLoc::get(&context, file, 1, 1))
        << "the reference executor runs C++, not the text of the dialect";
    return nullptr;
  }
  if (!options.source.check.numbers.empty()) {
    emitError(FileLineColLoc::get(&context, file, 1, 1))
        << "the reference executor is told of fields that must not be NaN by "
           "expectNumbers, not by --check=nan";
    return nullptr;
  }
  context.loadAllAvailableDialects();
  FrontendOptions frontend = getFrontendOptions(options.source);
  frontend.files = files;
  if (failed(setTunables(file, options.source.tunables, frontend, context)))
    return nullptr;
  std::vector<PipelineDescription> pipelines =
      describePipelines(options, frontend, context, entry.diagnostics);
  if (pipelines.empty())
    return nullptr;
  for (const PipelineDescription &pipeline : pipelines)
    object.pipelines.push_back(pipeline.name);
  object.symbol = referenceEntry;
  HostCode host = compileForHost(
      generateReferenceAdapter(pipelines, file), file, frontend,
      /*optimize=*/options.target.optLevel > 0, llvmContext, context);
  entry.needsHeader = host.needsHeader;
  // No function is called from elsewhere: to look up thousands of templates by
  // name would take most of the time that loading them takes.
  if (host.module)
    llvm::internalizeModule(*host.module, [&](const llvm::GlobalValue &value) {
      return value.getName() == referenceEntry ||
             (host.needsHeader && llvm::isa<llvm::GlobalVariable>(value));
    });
  return std::move(host.module);
}

static TargetOptions getTarget(const ObjectOptions &options) {
  TargetOptions target = options.target.leaveOut(options.source.synthesis);
  if (options.execution == ExecutionTarget::Reference)
    // Its code is big, and runs a few times.
    target.optLevel = std::min(target.optLevel, 1);
  return target;
}

/// The C++ library's own thread-local variables are out of JITCode's reach. Not
/// to find them is an error of the file that uses them, not of piko.h.
static void weakenThreadLocals(llvm::Module &module) {
  for (llvm::GlobalVariable &variable : module.globals())
    if (variable.isDeclaration() && variable.isThreadLocal())
      variable.setLinkage(llvm::GlobalValue::ExternalWeakLinkage);
}

/// Without a section for each function, of which JITCode is slow to take
/// thousands.
static void joinSections(llvm::Module &module) {
  for (llvm::Function &function : module)
    if (!function.isDeclaration() && !function.hasLocalLinkage()) {
      function.setComdat(nullptr);
      function.setLinkage(llvm::GlobalValue::ExternalLinkage);
    }
}

/// Finds or makes the code of piko.h that an entry needs; false after
/// diagnostics.
static bool addHeaderCode(const ObjectOptions &options,
                          const Processor &processor, const Files &files,
                          CompiledObject &object, std::string &diagnostics) {
  MLIRContext context;
  llvm::raw_string_ostream stream(diagnostics);
  DiagnosticPrinter printer(context, stream);
  FrontendOptions frontend = getFrontendOptions(options.source);
  frontend.files = files;
  auto generate = [&](llvm::Module &module) -> std::optional<std::string> {
    weakenThreadLocals(module);
    joinSections(module);
    llvm::Expected<std::string> code =
        generateCode(module, getTarget(options), CodeFormat::Object);
    if (code)
      return std::move(*code);
    stream << "error: " << llvm::toString(code.takeError()) << "\n";
    return std::nullopt;
  };
  std::optional<std::string> code = getHeaderCode(
      frontend, processor.name + processor.features, generate, context);
  object.headerCode = code.value_or("");
  return code.has_value();
}

/// Fills an entry but for its files; false after diagnostics, which are there
/// too.
static bool compile(const ObjectOptions &options,
                    llvm::ArrayRef<Processor> processors, const Files &files,
                    Entry &entry) {
  DialectRegistry registry;
  registerPikoDialects(registry);
  MLIRContext context(registry);
  llvm::raw_string_ostream stream(entry.diagnostics);
  DiagnosticPrinter printer(context, stream, options.remarks);
  if (options.source.text)
    printer.addText(options.source.file, *options.source.text);
  llvm::LLVMContext llvmContext;
  bool isReference = options.execution == ExecutionTarget::Reference;
  std::unique_ptr<llvm::Module> module =
      isReference
          ? compileReference(options, files, context, llvmContext, entry)
          : compilePipeline(options, processors, files, context, llvmContext,
                            entry.object);
  if (!module)
    return false;
  TargetOptions target = getTarget(options);
  if (!isReference) // whose functions say what they are for
    target.cpu = getBaseProcessor(module->getTargetTriple());
  llvm::Expected<std::string> code =
      generateCode(*module, target, CodeFormat::Object);
  if (!code) {
    stream << "error: " << llvm::toString(code.takeError()) << "\n";
    return false;
  }
  entry.object.code = std::move(*code);
  return true;
}

/// The user's text is a file among those on disk.
static Files openFiles(const CompileOptions &source) {
  Files disk = llvm::vfs::getRealFileSystem();
  if (!source.text)
    return disk;
  auto memory = llvm::makeIntrusiveRefCnt<llvm::vfs::InMemoryFileSystem>();
  llvm::SmallString<128> path(source.file);
  (void)disk->makeAbsolute(path);
  memory->addFile(path, 0, llvm::MemoryBuffer::getMemBufferCopy(*source.text));
  auto files = llvm::makeIntrusiveRefCnt<llvm::vfs::OverlayFileSystem>(disk);
  files->pushOverlay(memory);
  return files;
}

std::optional<CompiledObject> piko::compileObject(const ObjectOptions &given,
                                                  std::string &diagnostics) {
  ObjectOptions options = given;
  options.source.synthesis =
      options.target.leaveOutUnseen(options.source.synthesis);
  llvm::Expected<std::vector<Processor>> processors = resolveProcessors(
      options.target.cpu, llvm::Triple(llvm::sys::getProcessTriple()));
  if (!processors) {
    diagnostics += "error: " + llvm::toString(processors.takeError()) + "\n";
    return std::nullopt;
  }
  Files files = openFiles(options.source);
  auto finish = [&](Entry &entry) -> std::optional<CompiledObject> {
    if (entry.needsHeader && !addHeaderCode(options, processors->front(), files,
                                            entry.object, diagnostics))
      return std::nullopt;
    return std::move(entry.object);
  };
  SourceCache cache(options.source.cache);
  std::string request;
  if (cache.isEnabled()) {
    request = makeObjectRequest(options, *processors, *files);
    if (std::optional<std::string> found = cache.lookUp(request, *files)) {
      Entry entry = readEntry(*found);
      diagnostics += entry.diagnostics;
      return finish(entry);
    }
  }
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  Entry entry;
  bool ok = compile(options, *processors, recorder, entry);
  diagnostics += entry.diagnostics;
  if (!ok)
    return std::nullopt;
  entry.object.files = recorder->getFiles();
  if (!cache.isEnabled())
    return finish(entry);
  if (llvm::Error error = cache.keep(request, *recorder, writeEntry(entry)))
    diagnostics += "warning: cannot write to the cache '" +
                   cache.getDirectory() +
                   "': " + llvm::toString(std::move(error)) + "\n";
  return finish(entry);
}
