// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which passes of synthesis to leave out, `--without=PASS,...`; what is fixed
// and which directives are set before it; and what to count.

#ifndef PIKO_DRIVER_SYNTHESISOPTIONS_H
#define PIKO_DRIVER_SYNTHESISOPTIONS_H

#include "piko/macros_begin.h"

#include <optional>
#include <string>
#include <vector>

namespace piko {

/// What a program counts as it runs.
enum class Counting {
  None,
  Work, ///< What the text of each stage does, from the authored level on.
  Lanes ///< The operations and lanes of the code, on a CPU.
};

struct SynthesisOptions {
  /// Names of passes as piko-opt has them, but for `piko-`.
  std::vector<std::string> without;
  /// Values that constants and sizes of buffers have in all runs, as
  /// piko-fix-constants takes them.
  std::vector<std::string> fix = {};
  Counting count = Counting::None;
  /// Where estimates of a loop as vectors and as a scalar loop are within this
  /// factor of each other, code holds both, and the runtime measures which is
  /// faster. 1: nowhere.
  double mappingWindow = 2;
  /// `stage:key=value`, as piko-set-directives takes them.
  std::vector<std::string> directives = {};
  /// Divide runs among ranks (docs/Scale.md).
  bool ranks = false;

  bool has(const std::string &pass) const;
  /// All passes that can be left out; results are the same without them.
  static const std::vector<std::string> &getOptional();
  /// None of them.
  static SynthesisOptions none() { return {.without = getOptional()}; }
};

/// Reads names with commas between them, with or without `piko-`; none if one
/// is not of a pass that can be left out.
std::optional<SynthesisOptions> parseSynthesisOptions(const std::string &text);

/// What to say then.
std::string describeWrongSynthesisOptions(const std::string &text);

} // namespace piko

#include "piko/macros_end.h"

#endif // PIKO_DRIVER_SYNTHESISOPTIONS_H
