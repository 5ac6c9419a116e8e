// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's text to a program in memory.

#include "LibraryLoader.h"

#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Target/JIT.h"

#include "llvm/Support/xxhash.h"

#include <chrono>

using namespace piko;

namespace {

class JITProgram : public LoadedProgram {
public:
  JITProgram(std::unique_ptr<JITCode> code, const pikort_program *found,
             double taken, const CompiledObject &object)
      : code(std::move(code)) {
    program = found;
    milliseconds = taken;
    hash = llvm::xxh3_64bits(object.code);
    fromCache = object.isFromCache;
  }

private:
  std::unique_ptr<JITCode> code;
};

} // namespace

static llvm::Expected<const pikort_program *>
findProgram(JITCode &code, const std::string &symbol, ExecutionTarget target) {
  if (target == ExecutionTarget::CPU)
    return code.lookup<const pikort_program>(symbol);
  auto entry = code.lookup<const pikort_program *(int)>(symbol);
  if (!entry)
    return entry.takeError();
  return (*entry)(0);
}

static std::unique_ptr<LoadedProgram> loadHere(CompileOptions source,
                                               const LoadOptions &options,
                                               std::string &diagnostics) {
  auto start = std::chrono::steady_clock::now();
  source.pipeName = options.pipeName;
  source.includeDirs = options.includeDirs;
  source.defines = options.defines;
  source.tunables = options.tunables;
  source.check = options.check;
  source.synthesis = options.synthesis;
  source.gpu = options.gpu;
  source.cache = options.cache;
  bool isReference = options.target == ExecutionTarget::Reference;
  ObjectOptions objectOptions{
      .source = std::move(source),
      .execution = options.target,
      .target = {.cpu = isReference ? "native" : options.cpu,
                 .optLevel = options.optLevel,
                 .sanitizer =
                     isReference ? Sanitizer::None : JITCode::getSanitizer()}};
  std::optional<CompiledObject> object =
      compileObject(objectOptions, diagnostics);
  if (!object)
    return nullptr;
  auto fail = [&](llvm::Error error) {
    diagnostics += "error: " + llvm::toString(std::move(error)) + "\n";
    return nullptr;
  };
  auto code = JITCode::load({object->code, object->headerCode});
  if (!code)
    return fail(code.takeError());
  auto program = findProgram(**code, object->symbol, options.target);
  if (!program)
    return fail(program.takeError());
  std::chrono::duration<double, std::milli> taken =
      std::chrono::steady_clock::now() - start;
  return std::make_unique<JITProgram>(std::move(*code), *program, taken.count(),
                                      *object);
}

/// A host's stack may be small, and a text deep; and it lives on.
static std::unique_ptr<LoadedProgram> load(CompileOptions source,
                                           const LoadOptions &options,
                                           std::string &diagnostics) {
  std::unique_ptr<LoadedProgram> program;
  if (auto failed = runContained(
          [&] { program = loadHere(std::move(source), options, diagnostics); }))
    diagnostics += "error: " + *failed + "\n";
  return program;
}

std::unique_ptr<LoadedProgram> piko::loadPipeline(const std::string &file,
                                                  const LoadOptions &options,
                                                  std::string &diagnostics) {
  if (isPipelineLibrary(file))
    return loadFromLibrary(file, options, diagnostics);
  return load({.file = file}, options, diagnostics);
}

std::unique_ptr<LoadedProgram>
piko::loadPipelineText(const std::string &name, const std::string &text,
                       const LoadOptions &options, std::string &diagnostics) {
  return load({.file = name, .text = text}, options, diagnostics);
}
