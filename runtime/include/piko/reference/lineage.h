//===- piko/reference/lineage.h - Where a call comes from -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Checking mode (PIKO_CHECK) says of each error where it happened: the place in
// the user's file and the lineage of the primitive. Without it both are empty
// and nothing is kept.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_LINEAGE_H
#define PIKO_REFERENCE_LINEAGE_H

#include <piko/reference/error.h>

#include <memory>
#include <vector>
#ifdef PIKO_CHECK
#include <source_location>
#endif

namespace piko::reference {

#ifdef PIKO_CHECK
inline constexpr bool checking = true;
/// A place in the user's file: the default argument of the language's calls.
using SourcePlace = std::source_location;
#else
inline constexpr bool checking = false;
struct SourcePlace {
  static constexpr SourcePlace current() { return {}; }
};
#endif

/// A step of a lineage, linked to the one before it: a primitive of a source
/// (no stage), a call of a collecting stage (no step before it), or an
/// emission.
struct Step {
  mutable std::shared_ptr<const Step> before;
  std::string_view stage;
  int64_t place;  ///< the source, or the bin
  int64_t number; ///< of the primitive, the call or the emission

  /// Not by recursion: a lineage may be long.
  ~Step() {
    while (before && before.use_count() == 1)
      before = std::shared_ptr<const Step>(std::move(before->before));
  }
};
using Lineage = std::shared_ptr<const Step>;

inline Lineage makeStep(Lineage before, std::string_view stage, int64_t place,
                        int64_t number) {
  if constexpr (!checking)
    return nullptr;
  return std::make_shared<const Step>(
      Step{std::move(before), stage, place, number});
}

inline std::string toText(const Lineage &lineage) {
  if (!lineage)
    return "";
  constexpr size_t shown = 8; // of a long way the first and the last hops
  std::vector<const Step *> steps;
  for (const Step *step = lineage.get(); step; step = step->before.get())
    steps.push_back(step);
  std::string text;
  for (size_t left = steps.size(); left-- > 0;) {
    const Step &step = *steps[left];
    if (left > shown && steps.size() - left > shown + 1) {
      text += ", ... " + std::to_string(left + 1 - shown) + " hops ...";
      left = shown;
      continue;
    }
    std::string number = std::to_string(step.number);
    std::string place = std::to_string(step.place);
    if (step.stage.empty()) {
      text = "source " + place + " primitive " + number;
      continue;
    }
    text += (text.empty() ? "'" : ", '") + std::string(step.stage) + "' bin " +
            place + (step.before ? " emit " : " call ") + number;
  }
  return text;
}

/// The lines that follow a message: "\n  at file:line\n  lineage: ...".
inline std::string contextText([[maybe_unused]] const SourcePlace &at,
                               const Lineage &lineage,
                               const std::string &prefix = "") {
  std::string text;
#ifdef PIKO_CHECK
  if (at.line() != 0)
    text += "\n  " + prefix + "at " + at.file_name() + ":" +
            std::to_string(at.line());
#endif
  if (lineage)
    text += "\n  " + prefix + "lineage: " + toText(lineage);
  return text;
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_LINEAGE_H
