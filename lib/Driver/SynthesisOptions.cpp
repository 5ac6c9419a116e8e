// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Driver/SynthesisOptions.h"

#include <algorithm>
#include <sstream>

using namespace piko;

static bool contains(const std::vector<std::string> &names,
                     const std::string &name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::vector<std::string> &SynthesisOptions::getOptional() {
  static const std::vector<std::string> names = {
      "pre-schedule", "infer-directives", "fuse-stages",         "test-early",
      "prune",        "own-pixels",       "eliminate-schedules", "fuse-kernels",
      "form-strips",  "prefetch",         "compact-loops",       "vectorize"};
  return names;
}

bool SynthesisOptions::has(const std::string &pass) const {
  return !contains(without, pass);
}

std::optional<SynthesisOptions>
piko::parseSynthesisOptions(const std::string &text) {
  SynthesisOptions options;
  std::istringstream names(text);
  for (std::string name; std::getline(names, name, ',');) {
    if (!contains(SynthesisOptions::getOptional(), name))
      return std::nullopt;
    options.without.push_back(name);
  }
  return options;
}

std::string piko::describeWrongSynthesisOptions(const std::string &text) {
  std::string message = "--without: expected passes of";
  for (const std::string &name : SynthesisOptions::getOptional())
    message += " " + name + ",";
  return message + " but got '" + text + "'";
}
