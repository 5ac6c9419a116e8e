// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "LibraryLoader.h"

#include "ProgramSymbol.h"

#include "pikort/capture.h"

#include <chrono>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <iterator>

using namespace piko;

namespace {

class LibraryProgram : public LoadedProgram {
public:
  LibraryProgram(void *library, const pikort_program *found, double taken,
                 uint64_t codeHash)
      : library(library) {
    program = found;
    milliseconds = taken;
    hash = codeHash;
  }
  ~LibraryProgram() override { dlclose(library); }

private:
  void *library;
};

} // namespace

static uint64_t hashFile(const std::string &file) {
  std::ifstream stream(file, std::ios::binary);
  return rt::captureSum(
      std::string(std::istreambuf_iterator<char>(stream), {}));
}

/// What is asked of a text alone.
static std::string findMeaningless(const LoadOptions &options) {
  if (options.target == ExecutionTarget::Reference)
    return "the reference executor runs";
  if (!options.tunables.empty() || !options.defines.empty() ||
      !options.includeDirs.empty())
    return "macros, folders of headers and tunables are of";
  const SynthesisOptions &synthesis = options.synthesis;
  if (options.check.enabled || synthesis.count != Counting::None)
    return "checks and counters are compiled into";
  if (synthesis.ranks)
    return "exchanges between ranks are compiled into";
  if (!synthesis.without.empty() || !synthesis.fix.empty() ||
      !synthesis.directives.empty())
    return "passes, constants and directives are of";
  const GPUOptions &gpu = options.gpu;
  if (gpu.target == GPUTarget::Emulator || gpu.threads || gpu.blocks ||
      gpu.seed)
    return "blocks and threads are made of";
  const LoadOptions usual;
  if (options.cpu != usual.cpu || options.optLevel != usual.optLevel ||
      synthesis.mappingWindow != usual.synthesis.mappingWindow ||
      !gpu.cubins.empty())
    return "code for a processor or a chip is made of";
  return "";
}

std::unique_ptr<LoadedProgram> piko::loadFromLibrary(const std::string &file,
                                                     const LoadOptions &options,
                                                     std::string &diagnostics) {
  auto start = std::chrono::steady_clock::now();
  auto fail = [&](const std::string &why) {
    diagnostics += "error: " + file + ": " + why + "\n";
    return nullptr;
  };
  if (std::string text = findMeaningless(options); !text.empty())
    return fail("expected the text of a pipeline, which is what " + text +
                ", but this is a library");
  if (options.pipeName.empty())
    return fail("expected --pipe, the name of a pipeline in the library");
  // A name without a folder would be looked for elsewhere.
  void *library =
      dlopen(std::filesystem::absolute(file).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library)
    return fail(dlerror());
  std::string symbol = getProgramSymbol(defaultNamespace, options.pipeName);
  auto *program =
      static_cast<const pikort_program *>(dlsym(library, symbol.c_str()));
  if (!program) {
    dlclose(library);
    return fail("expected an object of pipeline '" + options.pipeName +
                "' in the library, with the symbol " + symbol);
  }
  std::chrono::duration<double, std::milli> taken =
      std::chrono::steady_clock::now() - start;
  return std::make_unique<LibraryProgram>(library, program, taken.count(),
                                          hashFile(file));
}
