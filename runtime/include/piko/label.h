//===- piko/label.h - What a stage may be called --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LABEL_H
#define PIKO_LABEL_H

namespace piko::detail {

/// What reports, traces and the names of versions can hold as it is.
constexpr bool isLabel(const char *text) {
  if (!*text)
    return false;
  for (; *text; ++text) {
    bool isLetter = (*text >= 'a' && *text <= 'z') ||
                    (*text >= 'A' && *text <= 'Z') ||
                    (*text >= '0' && *text <= '9');
    bool isMark = false;
    for (const char *mark = " _-.()"; *mark; ++mark)
      isMark = isMark || *text == *mark;
    if (!isLetter && !isMark)
      return false;
  }
  return true;
}
inline constexpr char labelRule[] =
    "expected a name of letters, digits, spaces and _-.(), but got '";

} // namespace piko::detail

#endif // PIKO_LABEL_H
