// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What there is to see of a pipeline's text.

#include "Piko/Driver/Inspect.h"

#include "Cache/OpenFiles.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/Diagnostics.h"
#include "Piko/Driver/Explain.h"
#include "Piko/Target/Object.h"
#include "Piko/Target/PTX.h"
#include "Piko/Target/Processor.h"

#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

using namespace mlir;
using namespace piko;

namespace {

/// A context whose diagnostics are a user's text.
class Inspection {
public:
  Inspection(const CompileOptions &source, std::string &diagnostics,
             bool remarks = false)
      : stream(diagnostics), printer(context, stream, remarks),
        files(openFiles(source)) {
    if (source.text)
      printer.addText(source.file, *source.text);
  }

  std::nullopt_t fail(llvm::Error error) {
    stream << "error: " << llvm::toString(std::move(error)) << "\n";
    return std::nullopt;
  }

  PikoContext context;
  llvm::raw_string_ostream stream;

private:
  DiagnosticPrinter printer;

public:
  const llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files;
};

} // namespace

std::optional<std::vector<std::string>>
piko::listPipelines(const CompileOptions &source, std::string &diagnostics) {
  Inspection inspection(source, diagnostics);
  auto names = readPipelineNames(source, inspection.context, inspection.files);
  if (failed(names))
    return std::nullopt;
  return std::move(*names);
}

std::optional<std::vector<Tunable>>
piko::listTunables(const CompileOptions &source, std::string &diagnostics) {
  Inspection inspection(source, diagnostics);
  auto found = readTunables(source, inspection.context, inspection.files);
  if (failed(found))
    return std::nullopt;
  std::vector<Tunable> tunables;
  for (TunableDescription &one : *found) {
    Tunable tunable{std::move(one.name), std::move(one.values), {}};
    if (auto place = dyn_cast<FileLineColLoc>(one.location)) {
      tunable.file = place.getFilename().str();
      tunable.line = place.getLine();
      tunable.column = place.getColumn();
    }
    tunables.push_back(std::move(tunable));
  }
  return tunables;
}

static std::string print(ModuleOp module) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  module->print(stream);
  stream << "\n";
  return text;
}

/// Kernels for a GPU, as a level or as PTX.
static std::optional<std::string> writeKernels(const TextOptions &options,
                                               ModuleOp module,
                                               Inspection &inspection) {
  const CompileOptions &source = options.source;
  if (failed(lowerToGPU(module, source.check, source.synthesis, source.gpu)))
    return std::nullopt;
  if (options.kind == TextKind::GPU)
    return print(module);
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> kernels = translateKernels(module, context);
  if (!kernels)
    return std::nullopt;
  llvm::Expected<std::string> text =
      generatePTX(*kernels, options.target.cpu, options.target.optLevel);
  if (!text)
    return inspection.fail(text.takeError());
  return std::move(*text);
}

/// LLVM IR, or assembly made of it.
static std::optional<std::string> translateText(const TextOptions &options,
                                                ModuleOp module,
                                                Inspection &inspection) {
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> translated = translateToLLVMIR(
      module, context, options.source.gpu, options.target.optLevel);
  if (!translated)
    return std::nullopt;
  if (options.kind == TextKind::LLVMIR) {
    std::string text;
    llvm::raw_string_ostream stream(text);
    translated->print(stream, nullptr);
    return text;
  }
  llvm::Expected<std::string> code = generateCode(
      *translated, options.target.leaveOut(options.source.synthesis),
      CodeFormat::Assembly);
  if (!code)
    return inspection.fail(code.takeError());
  return std::move(*code);
}

/// A level of the processor's, or what is made of it.
static std::optional<std::string> writeLevel(const TextOptions &options,
                                             ModuleOp module,
                                             const CPUOptions &cpu,
                                             Inspection &inspection) {
  const CompileOptions &source = options.source;
  static constexpr Level levels[] = {
      Level::Authored, Level::Kernels, Level::Machine, Level::Target,
      Level::LLVM,     Level::LLVM,    Level::LLVM};
  if (failed(lowerPipeline(module, levels[static_cast<int>(options.kind)],
                           source.check, source.synthesis, source.gpu, cpu)))
    return std::nullopt;
  if (options.kind >= TextKind::LLVMIR)
    return translateText(options, module, inspection);
  return print(module);
}

std::optional<std::string> piko::writeText(const TextOptions &options,
                                           std::string &diagnostics) {
  CompileOptions source = options.source;
  if (source.gpu.target == GPUTarget::Auto) {
    diagnostics += "error: expected one target, of which there is a text, but "
                   "auto is two\n";
    return std::nullopt;
  }
  // Who looks at it wants to see what the text means.
  if (options.kind == TextKind::Authored)
    source.reusesAuthored = false;
  Inspection inspection(source, diagnostics, options.remarks);
  bool isGPU = options.kind == TextKind::GPU || options.kind == TextKind::PTX;
  CPUOptions cpu;
  if (!isGPU) {
    llvm::Expected<llvm::Triple> triple = resolveTriple(options.target.arch);
    if (!triple)
      return inspection.fail(triple.takeError());
    llvm::Expected<Processor> processor =
        resolveProcessor(options.target.cpu, *triple);
    if (!processor)
      return inspection.fail(processor.takeError());
    cpu.lanes = processor->lanes;
  }
  OwningOpRef<ModuleOp> module =
      readPipeline(source, inspection.context, inspection.files);
  if (!module)
    return std::nullopt;
  if (isGPU)
    return writeKernels(options, *module, inspection);
  if (options.kind != TextKind::Report)
    return writeLevel(options, *module, cpu, inspection);
  auto report = explainPipeline(*module, source.check, source.synthesis, cpu,
                                source.gpu, options.target.optLevel);
  if (failed(report))
    return std::nullopt;
  return std::move(*report);
}
