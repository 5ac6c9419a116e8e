//===- Space.h - What a text leaves open ------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_SPACE_H
#define PIKO_TOOLS_PIKOTUNE_SPACE_H

#include "Search.h"
#include "TuneOptions.h"

#include "Piko/Driver/TunedSetting.h"

namespace piko::tune {

/// What a dimension sets.
struct Axis {
  enum Kind { Pipeline, Tunable, Directive, Pass, Strip } kind;
  std::string key; ///< a tunable's name, `stage:key`, or a pass
};

struct Space {
  std::vector<Dimension> dimensions;
  std::vector<Axis> axes; ///< one for each

  /// What a setting says to a compiler and a host.
  TunedSetting describe(const Setting &setting) const;
  /// The same in short, for people: what differs from the text.
  std::string name(const Setting &setting) const;
};

/// Reads the text: its tunables and the stages of the pipelines. On an error
/// the result is empty, and `diagnostics` holds what to show.
std::optional<Space> readSpace(const TuneOptions &options,
                               std::string &diagnostics);

/// What this machine's processor is called.
std::string getProcessorName();

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_SPACE_H
