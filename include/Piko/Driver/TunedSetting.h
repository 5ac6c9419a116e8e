// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko-tune chose for a pipeline, and the file that says so. No header of
// LLVM is needed here.
//
//   {
//     "pipeline": "Fused",
//     "tunables": {"tile": 16, "numbers": "Relaxed"},
//     "directives": {"rasterizer": {"schedule": "direct_map"}},
//     "without": ["prefetch"],
//     "strip": 4096,
//     "mappings": "Shade:0=vectors",
//     "measured": {"scene": "bunny.obj", ...}
//   }
//
// All members but the first may be missing. What was measured is for people.

#ifndef PIKO_DRIVER_TUNEDSETTING_H
#define PIKO_DRIVER_TUNEDSETTING_H

#include "Piko/Driver/Options.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace piko {

struct TunedSetting {
  std::string pipeline = {};
  /// Values of piko::tunable by their names, as listTunables() writes them.
  TunableSettings tunables = {};
  /// `stage:key=value`, as piko-set-directives takes them.
  std::vector<std::string> directives = {};
  /// Passes of synthesis to leave out.
  std::vector<std::string> without = {};
  /// Primitives of a source in a strip, which the host sets; 0 = what fits.
  int64_t stripSize = 0;
  /// Which versions of loops were measured to be faster, as
  /// pikort_set_mappings takes it, which the host calls; "" = not said.
  std::string mappings = {};

  /// Adds what is set to options. Returns what is wrong, as where they ask for
  /// another pipeline, or nothing.
  std::string apply(std::string &pipeName, TunableSettings &values,
                    SynthesisOptions &synthesis) const;
};

/// Reads a file; on an error the result is empty, and `error` says what is
/// wrong with which file and, where its text is not JSON, in which line.
std::optional<TunedSetting> readTunedSetting(const std::string &path,
                                             std::string &error);

/// The file's text. `measured` is the text of a JSON object.
std::string writeTunedSetting(const TunedSetting &setting,
                              const std::string &measured);

} // namespace piko

#endif // PIKO_DRIVER_TUNEDSETTING_H
