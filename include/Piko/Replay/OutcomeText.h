// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What runs left, from one process to another of the same order of bytes.

#ifndef PIKO_REPLAY_OUTCOMETEXT_H
#define PIKO_REPLAY_OUTCOMETEXT_H

#include "Piko/Replay/Outcome.h"

#include <optional>

namespace piko::replay {

/// May stand after others.
std::string writeOutcome(const Outcome &outcome);

/// All that were written one after the other; none if it is something else.
std::optional<std::vector<Outcome>> readOutcomes(std::string_view text);

} // namespace piko::replay

#endif // PIKO_REPLAY_OUTCOMETEXT_H
