// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The command line of pikoc, and what is asked of the compiler by it.

#ifndef PIKO_TOOLS_PIKOC_OPTIONS_H
#define PIKO_TOOLS_PIKOC_OPTIONS_H

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/TunedSetting.h"
#include "Piko/Support/Result.h"
#include "Piko/Target/Object.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace piko::pikoc {

/// From the level that is written to what is made of the last one.
enum class Emit {
  Authored,
  Kernels,
  Machine,
  Target,
  LLVM,
  LLVMIR,
  Assembly,
  Object,
  GPU,
  PTX
};

struct Options {
  std::string help; ///< the text, if that is asked for
  std::string file;
  std::vector<std::string> pipes = {""};
  std::optional<Emit> emit;
  std::string output = "-";
  std::string header, depfile; ///< empty: none
  std::string nameSpace, arch, cpu, cacheDirectory;
  GPUOptions gpu;
  bool setsGPUThreads = false, setsGPUChip = false;
  bool setsGPUSeed = false, setsGPUBlocks = false;
  int optLevel = 3;
  Sanitizer sanitizer = Sanitizer::None;
  bool listPipes = false, listTunables = false;
  bool explain = false, remarks = false, usesCache = true;
  std::vector<std::string> includeDirs, defines;
  CheckOptions check;
  SynthesisOptions synthesis;
  std::string tuned;    ///< a file's name; empty: none
  TunedSetting setting; ///< what it holds
  std::vector<std::string> llvm;

  bool isListing() const { return listPipes || listTunables; }
  /// As it is said, or follows from the outputs.
  Emit getEmit() const;
  /// Of one of the pipelines. Without what was tuned if `isTuned` is false.
  CompileOptions getSource(const std::string &pipe, bool isTuned = true) const;
  TargetOptions getTarget(const std::string &pipe) const;
};

/// Reads the file of --tuned, too.
support::Result<Options> parseOptions(const std::vector<std::string> &words);

} // namespace piko::pikoc

#endif // PIKO_TOOLS_PIKOC_OPTIONS_H
