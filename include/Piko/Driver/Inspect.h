// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What there is to see of a pipeline's text: its pipelines and tunables, a
// level of the compiler, a report. No header of LLVM is needed here.
//
// Each function returns nothing after an error; `diagnostics` gets what there
// is to show, with file and line where there is one.

#ifndef PIKO_DRIVER_INSPECT_H
#define PIKO_DRIVER_INSPECT_H

#include "Piko/Driver/Options.h"

#include <optional>
#include <string>
#include <vector>

namespace piko {

/// The names of the pipelines in a file, in the order in which they stand
/// there.
std::optional<std::vector<std::string>>
listPipelines(const CompileOptions &source, std::string &diagnostics);

/// A constant of a text that a tuner may choose.
struct Tunable {
  std::string name;
  /// The standard value, then the others, as a user writes them.
  std::vector<std::string> values;
  /// Of the first call of piko::tunable; empty and 0 if there is none.
  std::string file;
  unsigned line = 0, column = 0;
};

/// The tunables of a file; `.mlir` has none.
std::optional<std::vector<Tunable>> listTunables(const CompileOptions &source,
                                                 std::string &diagnostics);

enum class TextKind {
  Authored, ///< Stages with their phases.
  Kernels,  ///< Phases that run together.
  Machine,  ///< Structured work on bins.
  Target,   ///< Upstream dialects.
  LLVM,     ///< The llvm and omp dialects.
  LLVMIR,
  Assembly,
  GPU, ///< Kernels for a GPU, and what launches them.
  PTX,
  Report ///< What synthesis makes of the pipeline.
};

struct TextOptions {
  CompileOptions source;
  TextKind kind = TextKind::LLVMIR;
  /// The processor, or, of PTX, the chip.
  TargetOptions target = {};
  bool remarks = false;
};

/// The text of one pipeline. `--target auto` has two, and is an error.
std::optional<std::string> writeText(const TextOptions &options,
                                     std::string &diagnostics);

} // namespace piko

#endif // PIKO_DRIVER_INSPECT_H
