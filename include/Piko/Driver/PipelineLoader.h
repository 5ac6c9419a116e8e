// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's file to a program that the runtime can run, for hosts that
// know nothing of compilers: no header of LLVM is needed here.

#ifndef PIKO_DRIVER_PIPELINELOADER_H
#define PIKO_DRIVER_PIPELINELOADER_H

#include "pikort/pikort.h"

#include <memory>
#include <string>
#include <vector>

namespace piko {

/// What executes a pipeline.
enum class ExecutionTarget {
  CPU,      ///< Compiled, on all threads that the host allows.
  Reference ///< The reference executor of piko.h: sequential, and the measure.
};

struct LoadOptions {
  /// The pipeline to load; empty = the only one in the file.
  std::string pipeName;
  ExecutionTarget target = ExecutionTarget::CPU;
  /// `-I` and `-D`, without the letter.
  std::vector<std::string> includeDirs, defines;
};

/// A program that is ready to run; its code goes when the object goes, so it
/// must outlive the pipelines that pikort_create makes of it.
class LoadedProgram {
public:
  virtual ~LoadedProgram() = default;
  const pikort_program &get() const { return program; }
  /// From the text to here, in milliseconds.
  double compileMilliseconds() const { return milliseconds; }

protected:
  pikort_program program{};
  double milliseconds = 0;
};

/// Compiles a pipeline's file, C++ or `.mlir` (which the reference executor
/// does not read), and loads it. On an error the result is null and
/// `diagnostics` holds what to show, with file and line where there is one;
/// warnings are put there too.
std::unique_ptr<LoadedProgram> loadPipeline(const std::string &file,
                                            const LoadOptions &options,
                                            std::string &diagnostics);

} // namespace piko

#endif // PIKO_DRIVER_PIPELINELOADER_H
