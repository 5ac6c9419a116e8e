// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reading a pipeline and taking it down the levels.

#include "Piko/Driver/Compiler.h"

#include "Cache/AuthoredCache.h"
#include "Piko/Conversion/KernelImage.h"
#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/Sequences.h"
#include "Piko/Target/Emulate.h"
#include "Piko/Target/KernelImages.h"
#include "Piko/Target/PTX.h"
#include "Piko/Target/RuntimeCode.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/LLVMDialect.h"
#include "mlir/IR/Verifier.h"
#include "mlir/Interfaces/FunctionInterfaces.h"
#include "mlir/Parser/Parser.h"
#include "mlir/Target/LLVMIR/Export.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/Module.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/SourceMgr.h"

#include <dlfcn.h>
#include <sys/auxv.h>

using namespace mlir;
using namespace piko;

/// Standard input is `.mlir`, as piko-opt prints it.
static bool isMLIR(StringRef file) {
  return file.ends_with(".mlir") || file == "-";
}

/// Parses `.mlir`; null after diagnostics.
static OwningOpRef<ModuleOp> parseMLIR(StringRef file, MLIRContext &context,
                                       llvm::vfs::FileSystem &files) {
  auto text = file == "-" ? llvm::MemoryBuffer::getSTDIN()
                          : files.getBufferForFile(file);
  if (!text) {
    emitError(UnknownLoc::get(&context)) << "cannot open input file '" << file
                                         << "': " << text.getError().message();
    return {};
  }
  llvm::SourceMgr sources;
  sources.AddNewSourceBuffer(std::move(*text), llvm::SMLoc());
  return parseSourceFile<ModuleOp>(sources, &context);
}

/// The folder of the program, or of the shared library that this is in.
static llvm::SmallString<128> getOwnFolder() {
  llvm::SmallString<128> path;
  Dl_info own, main;
  auto *here = reinterpret_cast<void *>(&getOwnFolder);
  auto *headers = reinterpret_cast<void *>(getauxval(AT_PHDR)); // the program's
  if (dladdr(here, &own) && dladdr(headers, &main) &&
      own.dli_fbase != main.dli_fbase)
    (void)llvm::sys::fs::real_path(own.dli_fname, path);
  else
    path = llvm::sys::fs::getMainExecutable(nullptr, here);
  llvm::sys::path::remove_filename(path);
  return path;
}

static std::string findRuntimeIncludeDir() {
  // A library may be in a folder of a kind of machine.
  for (const char *up : {"..", "../.."}) {
    llvm::SmallString<128> path = getOwnFolder();
    llvm::sys::path::append(path, up, "include");
    llvm::sys::path::remove_dots(path, /*remove_dot_dot=*/true);
    if (llvm::sys::fs::exists(path + "/piko.h"))
      return std::string(path);
  }
  return PIKO_RUNTIME_INCLUDE_DIR;
}

std::string piko::getRuntimeIncludeDir() {
  // A library's name may be relative to the folder that it was loaded in.
  static const std::string found = findRuntimeIncludeDir();
  return found;
}

FrontendOptions piko::getFrontendOptions(const CompileOptions &options) {
  FrontendOptions result;
  result.includeDirs = options.includeDirs;
  result.defines = options.defines;
  if (options.check.enabled)
    result.defines.push_back("PIKO_CHECK");
  result.pipeName = options.pipeName;
  if (options.cache.enabled)
    result.headers = makeHeaderStore(options.cache);
  result.runtimeIncludeDir = getRuntimeIncludeDir();
  return result;
}

static bool hasGPUKernels(ModuleOp module) {
  return !module.getOps<gpu::GPUModuleOp>().empty();
}

/// Whether kernels for a GPU are launched on one.
static bool hasLaunches(ModuleOp module) {
  return module.walk([](gpu::LaunchFuncOp) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

/// Whether a kernel still has phases.
static bool hasPhases(KernelOp kernel) {
  return llvm::any_of(*kernel.getBodyBlock(), [](Operation &op) {
    return isa<ProcessOp, AssignOp>(op);
  });
}

Level piko::getLevel(ModuleOp module) {
  bool hasPipelines = false;
  Level level = Level::Authored;
  for (auto pipeline : module.getOps<PipelineOp>()) {
    hasPipelines = true;
    for (auto kernel : pipeline.getOps<KernelOp>())
      level =
          std::max(level, hasPhases(kernel) ? Level::Kernels : Level::Machine);
  }
  if (hasPipelines)
    return level;
  // What is left to convert is in other dialects.
  WalkResult result = module.walk([](Operation *op) {
    return isa<ModuleOp, gpu::GPUModuleOp>(op) ||
                   is_contained({"llvm", "nvvm", "omp"},
                                op->getName().getDialectNamespace())
               ? WalkResult::advance()
               : WalkResult::interrupt();
  });
  return result.wasInterrupted() ? Level::Target : Level::LLVM;
}

StringRef piko::getName(Level level) {
  constexpr StringRef names[] = {"authored", "kernels", "machine", "target",
                                 "llvm"};
  return names[static_cast<int>(level)];
}

/// The pipelines of a module, or the programs that they have become.
static std::vector<std::string> getNames(ModuleOp module) {
  std::vector<std::string> names;
  for (auto pipeline : module.getOps<PipelineOp>())
    names.push_back(pipeline.getSymName().str());
  for (auto function : module.getOps<FunctionOpInterface>()) {
    StringRef name = function.getName();
    if (name.consume_back(".run") &&
        module.lookupSymbol((name + ".setup").str()))
      names.push_back(name.str());
  }
  return names;
}

std::string piko::getPipelineName(ModuleOp module,
                                  const CompileOptions &options) {
  std::vector<std::string> names = getNames(module);
  return names.size() == 1 ? names.front() : options.pipeName;
}

/// Leaves only the pipeline of that name in a module.
static LogicalResult selectPipeline(ModuleOp module, StringRef file,
                                    StringRef name) {
  std::vector<std::string> names = getNames(module);
  std::string list = llvm::join(names, "', '");
  auto error = [&] {
    return emitError(FileLineColLoc::get(module.getContext(), file, 1, 1));
  };
  if (names.empty())
    return error() << "expected a pipeline, but the file has none";
  if (name.empty() && names.size() > 1)
    return error() << "expected the name of a pipeline, because the file has "
                      "several: '"
                   << list << "'";
  if (!name.empty() && !llvm::is_contained(names, name))
    return error() << "no pipeline is named '" << name << "'; the file has '"
                   << list << "'";
  for (auto pipeline : llvm::to_vector(module.getOps<PipelineOp>()))
    if (!name.empty() && pipeline.getSymName() != name)
      pipeline.erase();
  return success();
}

/// Whether what a tuner may set is still open.
static LogicalResult checkTuning(ModuleOp module,
                                 const CompileOptions &options) {
  if (!options.tunables.empty())
    return emitError(
               FileLineColLoc::get(module.getContext(), options.file, 1, 1))
           << "expected C++, because only its text has tunables";
  if (!options.synthesis.directives.empty() &&
      getLevel(module) != Level::Authored)
    return emitError(module.getLoc())
           << "directives: expected the authored level, but the file is at the "
           << getName(getLevel(module)) << " level";
  return success();
}

static OwningOpRef<ModuleOp>
readCpp(const CompileOptions &options, MLIRContext &context,
        llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files) {
  FrontendOptions frontend = getFrontendOptions(options);
  frontend.files = files;
  if (failed(setTunables(options.file, options.tunables, frontend, context)))
    return {};
  return translateCppToPiko(options.file, frontend, context);
}

OwningOpRef<ModuleOp>
piko::readPipeline(const CompileOptions &options, MLIRContext &context,
                   llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files) {
  context.loadAllAvailableDialects();
  if (!isMLIR(options.file))
    return findAuthored(options, context, files, [&](auto chosen) {
      return readCpp(options, context, chosen);
    });
  OwningOpRef<ModuleOp> module = parseMLIR(options.file, context, *files);
  if (!module ||
      failed(selectPipeline(*module, options.file, options.pipeName)) ||
      failed(checkTuning(*module, options)))
    return {};
  return module;
}

FailureOr<std::vector<std::string>>
piko::readPipelineNames(const CompileOptions &options, MLIRContext &context,
                        llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files) {
  context.loadAllAvailableDialects();
  if (!isMLIR(options.file)) {
    FrontendOptions frontend = getFrontendOptions(options);
    frontend.files = files;
    return listPipes(options.file, frontend, context);
  }
  OwningOpRef<ModuleOp> module = parseMLIR(options.file, context, *files);
  if (!module)
    return failure();
  return getNames(*module);
}

FailureOr<std::vector<TunableDescription>>
piko::readTunables(const CompileOptions &options, MLIRContext &context,
                   llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files) {
  context.loadAllAvailableDialects();
  if (isMLIR(options.file))
    return std::vector<TunableDescription>();
  FrontendOptions frontend = getFrontendOptions(options);
  frontend.files = files;
  return listTunables(options.file, frontend, context);
}

/// Findings and counts of work are about the stages as they are written.
static SynthesisOptions choosePasses(const CheckOptions &check,
                                     const SynthesisOptions &synthesis) {
  if (!check.enabled && synthesis.count != Counting::Work)
    return synthesis;
  SynthesisOptions chosen = synthesis;
  chosen.without = SynthesisOptions::getOptional();
  return chosen;
}

void piko::addPasses(OpPassManager &passes, Level from, Level to,
                     const CheckOptions &check,
                     const SynthesisOptions &synthesis, const GPUOptions &gpu,
                     const CPUOptions &cpu) {
  SynthesisOptions chosen = choosePasses(check, synthesis);
  auto goes = [&](Level level) { return from < level && level <= to; };
  if (check.enabled && from == Level::Authored)
    addCheckSequence(passes, check);
  if (goes(Level::Kernels))
    addSynthesisSequence(passes, chosen);
  if (goes(Level::Machine))
    addMachineSequence(passes, chosen);
  if (goes(Level::Target)) {
    if (gpu.target != GPUTarget::None)
      addGPUSequence(passes, gpu, chosen);
    else
      addCPUSequence(passes, chosen, cpu);
  }
  if (to >= Level::LLVM)
    addLLVMSequence(passes);
}

/// Whether the passes that are asked for can start from where a module is.
static LogicalResult checkStart(ModuleOp module, Level from, Level to,
                                const CheckOptions &check,
                                const SynthesisOptions &synthesis,
                                const GPUOptions &gpu) {
  if (from > to)
    return emitError(module.getLoc())
           << "expected the " << getName(to)
           << " level or one above it, but the file is at the " << getName(from)
           << " level";
  if (check.enabled && from != Level::Authored)
    return emitError(module.getLoc())
           << "--check: expected the authored level, but the file is at the "
           << getName(from) << " level";
  assert(gpu.target != GPUTarget::Auto && "compileObject makes both");
  if (check.enabled && gpu.target == GPUTarget::CUDA)
    return emitError(module.getLoc())
           << "--check: expected --target cpu or gpu-on-cpu, because what is "
              "checked is written down on the host";
  const char *option = !synthesis.fix.empty()              ? "--fix"
                       : synthesis.count == Counting::Work ? "--counters"
                                                           : nullptr;
  if (option && from != Level::Authored)
    return emitError(module.getLoc())
           << option << ": expected the authored level, but the file is at the "
           << getName(from) << " level";
  bool isGPU = gpu.target != GPUTarget::None;
  if (hasGPUKernels(module) && !isGPU)
    return emitError(module.getLoc())
           << "expected kernels for a CPU, but the file has some for a GPU, "
              "which --target cuda and --target gpu-on-cpu run and --emit=ptx "
              "writes";
  if (!hasGPUKernels(module) && isGPU && from > Level::Machine)
    return emitError(module.getLoc())
           << (gpu.target == GPUTarget::CUDA ? "--target cuda"
                                             : "--target gpu-on-cpu")
           << ": expected kernels for a GPU, or the machine level or one above "
              "it, but the file is at the "
           << getName(from) << " level";
  return success();
}

/// Verifies what comes out. Debug builds and piko-opt do so after each pass.
static LogicalResult run(PassManager &passes, ModuleOp module) {
#ifdef NDEBUG
  passes.enableVerifier(false);
#endif
  return success(succeeded(passes.run(module)) && succeeded(verify(module)));
}

LogicalResult piko::lowerPipeline(ModuleOp module, Level level,
                                  const CheckOptions &check,
                                  const SynthesisOptions &synthesis,
                                  const GPUOptions &gpu,
                                  const CPUOptions &cpu) {
  Level from = getLevel(module);
  if (failed(checkStart(module, from, level, check, synthesis, gpu)))
    return failure();
  PassManager passes(module.getContext());
  if (hasLaunches(module))
    addLaunchSequence(passes, gpu);
  addPasses(passes, from, level, check, synthesis, gpu, cpu);
  return run(passes, module);
}

SmallVector<OwningOpRef<ModuleOp>>
piko::lowerForEach(ArrayRef<CPUOptions> cpus, ModuleOp module,
                   const CheckOptions &check, const SynthesisOptions &synthesis,
                   const GPUOptions &gpu) {
  Level from = getLevel(module);
  bool hasVectors = from <= Level::Machine && gpu.target == GPUTarget::None;
  SynthesisOptions chosen = choosePasses(check, synthesis);
  auto lowerCommon = [&] {
    if (!hasVectors)
      return lowerPipeline(module, Level::LLVM, check, synthesis, gpu);
    if (failed(checkStart(module, from, Level::LLVM, check, synthesis, gpu)))
      return failure();
    PassManager passes(module.getContext());
    addPasses(passes, from, Level::Machine, check, synthesis);
    addScalarSequence(passes, chosen);
    return run(passes, module);
  };
  if (failed(lowerCommon()))
    return {};
  SmallVector<OwningOpRef<ModuleOp>> lowered;
  for (const CPUOptions &cpu : cpus) {
    lowered.push_back(module.clone());
    PassManager passes(module.getContext());
    if (hasVectors) {
      addVectorSequence(passes, chosen, cpu);
      addLLVMSequence(passes);
    }
    if (failed(run(passes, *lowered.back())))
      return {};
  }
  return lowered;
}

LogicalResult piko::lowerToGPU(ModuleOp module, const CheckOptions &check,
                               const SynthesisOptions &synthesis,
                               const GPUOptions &gpu) {
  if (hasGPUKernels(module))
    return success();
  Level from = getLevel(module);
  if (failed(checkStart(module, from, Level::Machine, check, synthesis, {})))
    return failure();
  Location loc = module.getLoc();
  for (auto pipeline : module.getOps<PipelineOp>())
    loc = pipeline.getLoc();
  PassManager passes(module.getContext());
  addPasses(passes, from, Level::Machine, check, synthesis);
  addGPUSequence(passes, gpu, choosePasses(check, synthesis));
  if (failed(run(passes, module)))
    return failure();
  if (hasGPUKernels(module))
    return success();
  return emitError(loc) << "expected a kernel, but the pipeline has none";
}

std::unique_ptr<llvm::Module>
piko::translate(Operation *op, llvm::LLVMContext &context, StringRef name) {
  std::unique_ptr<llvm::Module> module =
      translateModuleToLLVMIR(op, context, name);
  if (!module)
    return nullptr;
  auto kind = isa<gpu::GPUModuleOp>(op) ? RuntimeCode::GPU : RuntimeCode::CPU;
  if (llvm::Error error = inlineRuntimeCode(*module, kind)) {
    emitError(op->getLoc()) << llvm::toString(std::move(error));
    return nullptr;
  }
  return module;
}

/// Loads and stores are aligned as the layout says that is known by then, and
/// by LLVM's own one numbers of 64 bits are not.
static std::unique_ptr<llvm::Module>
translateForPTX(gpu::GPUModuleOp kernels, llvm::LLVMContext &context) {
  kernels->setAttr(LLVM::LLVMDialect::getDataLayoutAttrName(),
                   StringAttr::get(kernels.getContext(), getPTXLayout()));
  return translate(kernels, context, kernels.getName());
}

std::unique_ptr<llvm::Module>
piko::translateKernels(ModuleOp module, llvm::LLVMContext &context) {
  PassManager passes(module.getContext());
  addNVVMSequence(passes);
  if (failed(run(passes, module)))
    return nullptr;
  for (auto kernels : module.getOps<gpu::GPUModuleOp>())
    return translateForPTX(kernels, context);
  return nullptr;
}

std::unique_ptr<llvm::Module>
piko::translateToLLVMIR(ModuleOp module, llvm::LLVMContext &context,
                        const GPUOptions &gpu, int optLevel) {
  std::unique_ptr<llvm::Module> host = translate(module, context, "pipeline");
  for (auto kernels : module.getOps<gpu::GPUModuleOp>()) {
    bool isPTX = gpu.target == GPUTarget::CUDA;
    std::unique_ptr<llvm::Module> translated =
        isPTX ? translateForPTX(kernels, context)
              : translate(kernels, context, kernels.getName());
    if (!host || !translated)
      return nullptr;
    StringRef name = kernels.getName();
    auto report = [&](const MissingCubin &cubin) {
      (cubin.isRefused ? emitWarning(module.getLoc())
                       : emitRemark(module.getLoc()))
          << "no cubin for " << cubin.chip << ": " << cubin.reason;
    };
    llvm::Error error =
        isPTX ? embedKernels(*host, *translated, getImagesName(name), gpu,
                             optLevel, report)
              : linkEmulatedKernels(*host, std::move(translated), name);
    if (error) {
      emitError(module.getLoc()) << llvm::toString(std::move(error));
      return nullptr;
    }
  }
  return host;
}
