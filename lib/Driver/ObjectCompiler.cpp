// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's text to an object file, through the cache.

#include "Piko/Driver/ObjectCompiler.h"

#include "Cache/KnownFiles.h"
#include "Cache/OpenFiles.h"
#include "Cache/SourceCache.h"
#include "Header/HeaderWriter.h"
#include "ObjectRequest.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/Versions.h"
#include "ProgramSymbol.h"
#include "ReferenceObject.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/Path.h"

#include "Piko/Analysis/LinearFacts.h"
#include "pikort/pikort.h"

using namespace mlir;
using namespace piko;

static_assert(maxDomainExtent == PIKORT_MAX_EXTENT);

using Files = llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem>;

namespace {

/// An object and what was said when it was made.
struct Entry {
  CompiledObject object;
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
  writer.add(entry.diagnostics);
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
          if (diagnostic.getSeverity() != mlir::DiagnosticSeverity::Error)
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
                const llvm::Triple &triple, const Files &files,
                MLIRContext &context, llvm::LLVMContext &llvmContext,
                CompiledObject &object) {
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
  return defineProgram(std::move(translated), name, object.symbol, processors,
                       triple);
}

/// Fills an entry but for its files; false after diagnostics, which are there
/// too.
static bool compile(const ObjectOptions &options,
                    llvm::ArrayRef<Processor> processors,
                    const llvm::Triple &triple, const Files &files,
                    Entry &entry) {
  PikoContext context;
  llvm::raw_string_ostream stream(entry.diagnostics);
  DiagnosticPrinter printer(context, stream, options.remarks);
  if (options.source.text)
    printer.addText(options.source.file, *options.source.text);
  llvm::LLVMContext llvmContext;
  std::unique_ptr<llvm::Module> module = compilePipeline(
      options, processors, triple, files, context, llvmContext, entry.object);
  if (!module)
    return false;
  piko::TargetOptions target =
      options.target.leaveOut(options.source.synthesis);
  // The functions say what they are for.
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

Files piko::openFiles(const CompileOptions &source) {
  Files disk = llvm::makeIntrusiveRefCnt<KnownFiles>();
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

/// Whether C++ takes it for the name of a namespace, nested or not.
static bool isNamespace(llvm::StringRef name) {
  llvm::SmallVector<llvm::StringRef> parts;
  name.split(parts, "::");
  return llvm::all_of(parts, [](llvm::StringRef part) {
    return !part.empty() && !llvm::isDigit(part[0]) &&
           llvm::all_of(part,
                        [](char c) { return llvm::isAlnum(c) || c == '_'; });
  });
}

std::optional<CompiledObject> piko::compileObject(const ObjectOptions &given,
                                                  std::string &diagnostics) {
  if (!given.nameSpace.empty() && given.execution == ExecutionTarget::CPU &&
      !isNamespace(given.nameSpace)) {
    diagnostics += "error: expected a namespace such as 'a' or 'a::b', but got "
                   "'" +
                   given.nameSpace + "'\n";
    return std::nullopt;
  }
  if (given.execution == ExecutionTarget::Reference)
    return compileReferenceObject(given, diagnostics);
  ObjectOptions options = given;
  options.source.synthesis =
      options.target.leaveOutUnseen(options.source.synthesis);
  auto fail = [&](llvm::Error error) {
    diagnostics += "error: " + llvm::toString(std::move(error)) + "\n";
    return std::nullopt;
  };
  llvm::Expected<llvm::Triple> triple = resolveTriple(options.target.arch);
  if (!triple)
    return fail(triple.takeError());
  llvm::Expected<std::vector<Processor>> processors =
      resolveProcessors(options.target.cpu, *triple);
  if (!processors)
    return fail(processors.takeError());
  Files files = openFiles(options.source);
  SourceCache cache(options.source.cache);
  std::string request;
  if (cache.isEnabled()) {
    request = makeObjectRequest(options, *processors, *files);
    if (std::unique_ptr<llvm::MemoryBuffer> found =
            cache.lookUp(request, *files)) {
      Entry entry = readEntry(found->getBuffer());
      entry.object.isFromCache = true;
      diagnostics += entry.diagnostics;
      return std::move(entry.object);
    }
  }
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  Entry entry;
  bool ok = compile(options, *processors, *triple, recorder, entry);
  diagnostics += entry.diagnostics;
  if (!ok)
    return std::nullopt;
  entry.object.files = recorder->getFiles();
  if (!cache.isEnabled())
    return std::move(entry.object);
  if (llvm::Error error = cache.keep(request, *recorder, writeEntry(entry)))
    diagnostics += "warning: cannot write to the cache '" +
                   cache.getDirectory() +
                   "': " + llvm::toString(std::move(error)) + "\n";
  return std::move(entry.object);
}
