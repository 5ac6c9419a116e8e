// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The reference executor of a file as an object.

#include "ReferenceObject.h"

#include "Cache/HeaderCache.h"
#include "Cache/OpenFiles.h"
#include "Cache/SourceCache.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Frontend/HostCompiler.h"
#include "Piko/Target/Object.h"

#include "llvm/Support/Path.h"
#include "llvm/Transforms/IPO/Internalize.h"

#include <set>

using namespace mlir;
using namespace piko;

using Files = llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem>;
using Recorder = llvm::IntrusiveRefCntPtr<SourceRecorder>;

static const char *const referenceEntry = "piko_reference_program";

namespace {

/// The first step: the C++ that Clang compiles after the file, and with which
/// macros.
struct Adapter {
  std::string text;
  std::vector<std::string> defines, pipelines, files;
  std::string diagnostics;
  bool isFromCache = false;
};

/// The second step.
struct HostObject {
  std::string code;
  /// Whether there is to be code of piko.h, which is kept apart.
  bool needsHeader = false;
  std::vector<std::string> files;
  std::string diagnostics;
  bool isFromCache = false;
};

} // namespace

//===----------------------------------------------------------------------===//
// Entries of the cache
//===----------------------------------------------------------------------===//

static void addList(StringWriter &writer, llvm::ArrayRef<std::string> list) {
  writer.add(std::to_string(list.size()));
  for (const std::string &item : list)
    writer.add(item);
}

static std::vector<std::string> nextList(StringReader &reader) {
  size_t size = 0;
  llvm::to_integer(reader.next(), size);
  std::vector<std::string> list;
  while (!reader.atEnd() && list.size() < size)
    list.push_back(reader.next());
  return list;
}

static std::string write(const Adapter &adapter) {
  StringWriter writer;
  writer.add(adapter.text).add(adapter.diagnostics);
  for (const auto *list :
       {&adapter.defines, &adapter.pipelines, &adapter.files})
    addList(writer, *list);
  return writer.bytes;
}

static void read(llvm::StringRef bytes, Adapter &adapter) {
  StringReader reader(bytes);
  adapter.text = reader.next();
  adapter.diagnostics = reader.next();
  for (auto *list : {&adapter.defines, &adapter.pipelines, &adapter.files})
    *list = nextList(reader);
}

static std::string write(const HostObject &object) {
  StringWriter writer;
  writer.add(object.code).add(object.diagnostics);
  writer.add(object.needsHeader ? "header" : "");
  addList(writer, object.files);
  return writer.bytes;
}

static void read(llvm::StringRef bytes, HostObject &object) {
  StringReader reader(bytes);
  object.code = reader.next();
  object.diagnostics = reader.next();
  object.needsHeader = !reader.next().empty();
  object.files = nextList(reader);
}

/// Finds what was made of a request, or makes it and keeps it; false after an
/// error, whose diagnostics are in what was made.
template <class T, class F>
static bool findOrMake(const CacheOptions &options, llvm::StringRef request,
                       const Files &files, T &made, std::string &diagnostics,
                       F make) {
  SourceCache cache(options);
  if (cache.isEnabled())
    if (std::unique_ptr<llvm::MemoryBuffer> found =
            cache.lookUp(request, *files)) {
      read(found->getBuffer(), made);
      made.isFromCache = true;
      diagnostics += made.diagnostics;
      return true;
    }
  auto recorder = llvm::makeIntrusiveRefCnt<SourceRecorder>(files);
  bool ok = make(recorder);
  diagnostics += made.diagnostics;
  if (!ok)
    return false;
  made.files = recorder->getFiles();
  if (!cache.isEnabled())
    return true;
  if (llvm::Error error = cache.keep(request, *recorder, write(made)))
    diagnostics += "warning: cannot write to the cache '" +
                   cache.getDirectory() +
                   "': " + llvm::toString(std::move(error)) + "\n";
  return true;
}

//===----------------------------------------------------------------------===//
// The adapter
//===----------------------------------------------------------------------===//

/// All that decides what it says, but for the files.
static std::string makeAdapterRequest(const ObjectOptions &options,
                                      llvm::vfs::FileSystem &files) {
  const CompileOptions &source = options.source;
  KeyBuilder key;
  key.add("reference adapter");
  addSurroundings(key, CompilerPart::Frontend);
  addFolder(key, files);
  key.add(source.file).add(source.pipeName).add(getRuntimeIncludeDir());
  for (const auto *list : {&source.includeDirs, &source.defines}) {
    key.add(std::to_string(list->size()));
    for (const std::string &item : *list)
      key.add(item);
  }
  for (const auto &[name, value] : source.tunables)
    key.add(name).add(value);
  key.add(source.check.enabled ? "checked" : "");
  key.add(options.allPipelines ? "all" : "one");
  return key.finish();
}

/// What the reference executor shall run; empty after diagnostics.
static std::vector<PipelineDescription>
describe(const ObjectOptions &options, FrontendOptions frontend,
         const Recorder &recorder, const PipelineDescriber &describeAll,
         MLIRContext &context, std::string &diagnostics) {
  if (options.allPipelines && describeAll)
    return describeAll(recorder, diagnostics);
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

/// Whether there can be a reference executor; says why not.
static LogicalResult checkSource(const CompileOptions &source,
                                 MLIRContext &context) {
  auto error = [&] {
    return emitError(FileLineColLoc::get(&context, source.file, 1, 1));
  };
  if (llvm::StringRef(source.file).ends_with(".mlir"))
    return error()
           << "the reference executor runs C++, not the text of the dialect";
  if (!source.check.numbers.empty())
    return error() << "the reference executor is told of fields that must not "
                      "be NaN by "
                      "expectNumbers, not by --check=nan";
  return success();
}

namespace {

/// A context whose diagnostics go into a string.
struct Reader {
  Reader(const CompileOptions &source, std::string &diagnostics, bool remarks)
      : stream(diagnostics), printer(context, stream, remarks) {
    context.loadAllAvailableDialects();
    if (source.text)
      printer.addText(source.file, *source.text);
  }

  PikoContext context;
  llvm::raw_string_ostream stream;
  DiagnosticPrinter printer;
};

} // namespace

/// False after diagnostics.
static bool makeAdapter(const ObjectOptions &options, const Recorder &recorder,
                        const PipelineDescriber &describeAll,
                        Adapter &adapter) {
  const CompileOptions &source = options.source;
  Reader reader(source, adapter.diagnostics, options.remarks);
  FrontendOptions frontend = getFrontendOptions(source);
  frontend.files = recorder;
  if (failed(checkSource(source, reader.context)) ||
      failed(
          setTunables(source.file, source.tunables, frontend, reader.context)))
    return false;
  std::vector<PipelineDescription> pipelines =
      describe(options, frontend, recorder, describeAll, reader.context,
               adapter.diagnostics);
  for (const PipelineDescription &pipeline : pipelines)
    adapter.pipelines.push_back(pipeline.name);
  if (pipelines.empty())
    return false;
  adapter.text = generateReferenceAdapter(pipelines, source.file);
  adapter.defines = frontend.defines;
  return true;
}

//===----------------------------------------------------------------------===//
// Its object
//===----------------------------------------------------------------------===//

/// Its code is big, and runs a few times.
static piko::TargetOptions getTarget(const ObjectOptions &options) {
  piko::TargetOptions target =
      options.target.leaveOut(options.source.synthesis);
  target.optLevel = std::min(target.optLevel, 1);
  return target;
}

/// All that decides what Clang makes of the adapter, but for the files.
static std::string makeHostRequest(const Adapter &adapter,
                                   const FrontendOptions &frontend,
                                   const piko::TargetOptions &target,
                                   const Processor &processor,
                                   llvm::vfs::FileSystem &files) {
  KeyBuilder key;
  key.add("reference");
  addSurroundings(key, CompilerPart::Clang);
  std::vector<std::string> arguments =
      getHostArguments(frontend, /*optimize=*/target.optLevel > 0);
  if (hasRelativeFolders(arguments))
    addFolder(key, files);
  for (const std::string &argument : arguments)
    key.add(argument);
  for (int number : {target.optLevel, int(target.sanitizer),
                     int(target.loopVectorize), int(target.slpVectorize)})
    key.add(std::to_string(number));
  key.add(processor.name).add(processor.features).add(adapter.text);
  return key.finish();
}

/// False after diagnostics.
static bool makeObject(const ObjectOptions &options, const Adapter &adapter,
                       FrontendOptions frontend,
                       const piko::TargetOptions &target,
                       const Recorder &recorder, HostObject &object) {
  const CompileOptions &source = options.source;
  Reader reader(source, object.diagnostics, options.remarks);
  frontend.files = recorder;
  llvm::LLVMContext llvmContext;
  HostCode host = compileForHost(adapter.text, source.file, frontend,
                                 /*optimize=*/target.optLevel > 0, llvmContext,
                                 reader.context);
  if (!host.module)
    return false;
  object.needsHeader = host.needsHeader;
  // No function is called from elsewhere: to look up thousands of templates by
  // name would take most of the time that loading them takes.
  llvm::internalizeModule(*host.module, [&](const llvm::GlobalValue &value) {
    return value.getName() == referenceEntry ||
           (host.needsHeader && llvm::isa<llvm::GlobalVariable>(value));
  });
  llvm::Expected<std::string> code =
      generateCode(*host.module, target, CodeFormat::Object);
  if (!code) {
    reader.stream << "error: " << llvm::toString(code.takeError()) << "\n";
    return false;
  }
  object.code = std::move(*code);
  return true;
}

//===----------------------------------------------------------------------===//
// The object of piko.h
//===----------------------------------------------------------------------===//

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

/// Finds or makes it; null after diagnostics.
static std::unique_ptr<llvm::MemoryBuffer>
findHeaderCode(const ObjectOptions &options, const Processor &processor,
               const Files &files, std::string &diagnostics) {
  PikoContext context;
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
  return getHeaderCode(frontend, processor.name + processor.features, generate,
                       context);
}

std::optional<CompiledObject>
piko::compileReferenceObject(const ObjectOptions &options,
                             std::string &diagnostics,
                             const PipelineDescriber &describeAll) {
  llvm::Expected<Processor> processor = resolveProcessor(options.target.cpu);
  if (!processor) {
    diagnostics += "error: " + llvm::toString(processor.takeError()) + "\n";
    return std::nullopt;
  }
  const CompileOptions &source = options.source;
  Files files = openFiles(source);
  Adapter adapter;
  if (!findOrMake(source.cache, makeAdapterRequest(options, *files), files,
                  adapter, diagnostics, [&](const Recorder &recorder) {
                    return makeAdapter(options, recorder, describeAll, adapter);
                  }))
    return std::nullopt;
  FrontendOptions frontend = getFrontendOptions(source);
  frontend.defines = adapter.defines;
  TargetOptions target = getTarget(options);
  HostObject host;
  if (!findOrMake(
          source.cache,
          makeHostRequest(adapter, frontend, target, *processor, *files), files,
          host, diagnostics, [&](const Recorder &recorder) {
            return makeObject(options, adapter, frontend, target, recorder,
                              host);
          }))
    return std::nullopt;
  CompiledObject object;
  object.symbol = referenceEntry;
  object.isFromCache = adapter.isFromCache && host.isFromCache;
  object.pipelines = std::move(adapter.pipelines);
  object.code = std::move(host.code);
  std::set<std::string> all(adapter.files.begin(), adapter.files.end());
  all.insert(host.files.begin(), host.files.end());
  object.files.assign(all.begin(), all.end());
  if (!host.needsHeader)
    return object;
  std::unique_ptr<llvm::MemoryBuffer> code =
      findHeaderCode(options, *processor, files, diagnostics);
  if (!code)
    return std::nullopt;
  object.headerCode = code->getBuffer().str();
  return object;
}
