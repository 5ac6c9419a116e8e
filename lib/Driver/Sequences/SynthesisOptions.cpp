// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Driver/SynthesisOptions.h"

#include <algorithm>
#include <sstream>
#include <string_view>

using namespace piko;

static bool contains(const std::vector<std::string> &names,
                     const std::string &name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::vector<std::string> &SynthesisOptions::getOptional() {
  static const std::vector<std::string> names = {
      "pre-schedule", "infer-directives", "fuse-stages", "test-early", "prune",
      "own-pixels", "eliminate-schedules", "fuse-kernels", "form-strips",
      "form-gbuffer", "defer-shading", "form-tiles", "prefetch", "vectorize",
      "lockstep", "flatten-nests", "merge-nests", "compact-loops",
      "prove-bounds", "hoist-loads", "hoist-bounds", "merge-bounds",
      "combine-bounds", "thread-jumps", "narrow-integers", "distribute-loops",
      "reduce-strength", "peel-vectors", "merge-gathers", "pair-gathers",
      "tabulate-invariants", "unroll-and-jam", "unswitch-versions",
      "if-convert", "uplift-pixel-loops", "privatize", "reduce-updates",
      "reduce-by-atomics",
      // of a GPU
      "share-appends", "collapse-pixels", "group-updates", "share-by-count",
      "compact-work", "split-rare",
      // of LLVM
      "loop-vectorize", "slp-vectorizer"};
  return names;
}

bool SynthesisOptions::has(const std::string &pass) const {
  return !contains(without, pass);
}

/// What lies between commas.
static std::vector<std::string> split(const std::string &text) {
  std::vector<std::string> words;
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');)
    words.push_back(word);
  return words;
}

/// The name of a pass as reports and piko-opt have it may stand for the short
/// one.
static std::string shorten(const std::string &name) {
  constexpr std::string_view prefix = "piko-";
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

std::optional<SynthesisOptions>
piko::parseSynthesisOptions(const std::string &text) {
  SynthesisOptions options;
  for (const std::string &name : split(text)) {
    options.without.push_back(shorten(name));
    if (!contains(SynthesisOptions::getOptional(), options.without.back()))
      return std::nullopt;
  }
  return options;
}

std::string piko::describeWrongSynthesisOptions(const std::string &text) {
  std::string message = "--without: expected passes of";
  for (const std::string &name : SynthesisOptions::getOptional())
    message += " " + name + ",";
  std::string wrong;
  for (const std::string &name : split(text))
    if (wrong.empty() && !parseSynthesisOptions(name))
      wrong = name;
  return message + " but got '" + wrong + "'";
}
