// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The driver of a tool that has no compiler, and runs what was compiled ahead
// of time. No LLVM in it.

#include "LibraryLoader.h"

#include "Piko/Driver/TunedSetting.h"

using namespace piko;

static const char *const lacking = "this program has no compiler, and runs "
                                   "pipelines of shared libraries alone";

std::unique_ptr<LoadedProgram> piko::loadPipeline(const std::string &file,
                                                  const LoadOptions &options,
                                                  std::string &diagnostics) {
  if (isPipelineLibrary(file))
    return loadFromLibrary(file, options, diagnostics);
  diagnostics += "error: " + file + ": " + lacking + "\n";
  return nullptr;
}

std::optional<SynthesisOptions>
piko::parseSynthesisOptions(const std::string &) {
  return std::nullopt;
}

std::string piko::describeWrongSynthesisOptions(const std::string &) {
  return lacking;
}

/// Which libraries refuse.
std::optional<CheckOptions> piko::parseCheckOptions(const std::string &) {
  return CheckOptions{.enabled = true, .numbers = {}};
}

std::optional<TunedSetting> piko::readTunedSetting(const std::string &path,
                                                   std::string &error) {
  error = path + ": " + lacking;
  return std::nullopt;
}

std::string TunedSetting::apply(std::string &, TunableSettings &,
                                SynthesisOptions &) const {
  return lacking;
}
