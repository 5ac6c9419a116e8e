// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// From a pipeline's text to an object file in memory, through the cache. No
// header of LLVM is needed here.

#ifndef PIKO_DRIVER_OBJECTCOMPILER_H
#define PIKO_DRIVER_OBJECTCOMPILER_H

#include "Piko/Driver/Options.h"

#include <optional>

namespace piko {

struct ObjectOptions {
  CompileOptions source;
  ExecutionTarget execution = ExecutionTarget::CPU;
  TargetOptions target = {};
  /// The C++ namespace of the generated class; a part of the object's symbol.
  std::string nameSpace = defaultNamespace;
  /// For the reference executor: all pipelines of the file, whichever `source`
  /// names, but those with errors, which go into the diagnostics.
  bool allPipelines = false;
  bool remarks = false;
};

struct CompiledObject {
  /// The names of the pipelines; one if not all were asked for.
  std::vector<std::string> pipelines;
  /// The object's one external definition, a pikort_program; for the reference
  /// executor, a function from the place of a pipeline in `pipelines` to the
  /// address of one.
  std::string symbol;
  std::string code;
  /// A second object that the first one needs, with functions of piko.h: of the
  /// reference executor without optimization. Empty = none.
  std::string headerCode;
  /// The C++ header for hosts; empty for the reference executor, and for
  /// `.mlir` below the machine level, where nothing is left to make it of.
  std::string header;
  /// The files that were read, sorted.
  std::vector<std::string> files;
  /// Whether nothing had to be compiled.
  bool isFromCache = false;
};

/// Compiles, or finds in the cache what the same text, headers and options gave
/// before. `diagnostics` gets what there is to show, with file and line where
/// there is one; the result is empty after an error.
std::optional<CompiledObject> compileObject(const ObjectOptions &options,
                                            std::string &diagnostics);

} // namespace piko

#endif // PIKO_DRIVER_OBJECTCOMPILER_H
