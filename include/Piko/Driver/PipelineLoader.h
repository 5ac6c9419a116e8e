// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's text to a program that the runtime can run, for hosts that
// know nothing of compilers: no header of LLVM is needed here.
//
//   piko::LoadOptions options;
//   options.pipeName = "DrawPipe";
//   std::string diagnostics;
//   auto program = piko::loadPipeline("draw.piko.cpp", options, diagnostics);
//   if (!program) { show diagnostics }
//   piko::rt::Pipeline pipe(program->get()); // of pikort/pikort.hpp

#ifndef PIKO_DRIVER_PIPELINELOADER_H
#define PIKO_DRIVER_PIPELINELOADER_H

#include "piko/macros_begin.h"

#include "Piko/Driver/Options.h"

#include "pikort/pikort.h"

#include <memory>
#include <string>
#include <vector>

namespace piko {

struct LoadOptions {
  /// The pipeline to load; empty = the only one in the file.
  std::string pipeName = {};
  ExecutionTarget target = ExecutionTarget::CPU;
  /// `-I` and `-D`, without the letter.
  std::vector<std::string> includeDirs = {}, defines = {};
  TunableSettings tunables = {};
  CacheOptions cache = {};
  /// What is checked while the pipeline runs. The reference executor is told in
  /// the pipeline's text of fields that must not be NaN.
  CheckOptions check = {};
  SynthesisOptions synthesis = {};
  GPUOptions gpu = {};
  /// The processor to compile for, as TargetOptions has it; one that this
  /// machine is no less than.
  std::string cpu = "native";
  /// 0 to 3, as in -O3. The reference executor is never optimised beyond 1: its
  /// code is big, and runs a few times.
  int optLevel = 3;
};

/// A program that is ready to run; its code goes when the object goes, so it
/// must outlive the pipelines that pikort_create makes of it.
class LoadedProgram {
public:
  virtual ~LoadedProgram() = default;
  const pikort_program &get() const { return *program; }
  /// From the text to here, in milliseconds.
  double compileMilliseconds() const { return milliseconds; }
  /// Whether nothing had to be compiled: its code was in the cache.
  bool isFromCache() const { return fromCache; }
  /// A hash of the code: what has the same runs the same.
  uint64_t codeHash() const { return hash; }

protected:
  const pikort_program *program = nullptr;
  double milliseconds = 0;
  uint64_t hash = 0;
  bool fromCache = false;
};

/// Whether a file holds what was compiled ahead of time, by its name.
inline bool isPipelineLibrary(const std::string &file) {
  return file.ends_with(".so");
}

/// Compiles a pipeline's file, C++ or `.mlir` (which the reference executor
/// does not read), for this machine, or finds its code in the cache, and loads
/// it. A file whose name ends in `.so` is a shared library of objects that
/// pikoc has made, in its standard namespace, of which one is loaded as it is:
/// what options say of its text is an error. On an error the result is null and
/// `diagnostics` holds what to show, with file and line where there is one;
/// warnings are put there too.
std::unique_ptr<LoadedProgram> loadPipeline(const std::string &file,
                                            const LoadOptions &options,
                                            std::string &diagnostics);

/// The same for text in memory. `name` is what diagnostics call it; headers
/// are looked for as if it were a file of that name.
std::unique_ptr<LoadedProgram> loadPipelineText(const std::string &name,
                                                const std::string &text,
                                                const LoadOptions &options,
                                                std::string &diagnostics);

} // namespace piko

#include "piko/macros_end.h"

#endif // PIKO_DRIVER_PIPELINELOADER_H
