// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a run left in a pipeline's state.

#ifndef PIKO_REPLAY_OUTCOME_H
#define PIKO_REPLAY_OUTCOME_H

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

struct pikort_pipeline;

namespace piko::replay {

struct Field {
  std::string name;
  int64_t offset, elements, stride;
  int32_t type; ///< pikort_field_type
};

/// The records of a constant, a buffer or an image.
struct Records {
  std::string bytes;
  int64_t size = 1; ///< of one record
  std::vector<Field> fields;
};

struct Outcome {
  std::map<std::string, Records> state;
  std::string error; ///< of a run that stopped; then there is no state

  bool isBlank() const;
};

/// Compares field by field, so that padding does not matter and all NaNs are
/// equal. Returns what differs, a line for each piece of state.
std::vector<std::string> compareOutcomes(const Outcome &expected,
                                         const Outcome &actual);

/// FNV-1a of 64 bits, of bytes one after the other.
uint64_t hashBytes(std::string_view bytes);

/// Equal outcomes, as compareOutcomes has it, have equal hashes.
uint64_t hashOutcome(const Outcome &outcome);

/// The leaves of a record. Throws std::runtime_error.
std::vector<Field> getFields(pikort_pipeline *pipeline, int32_t record);

/// What a pipeline holds after a run: all state that is not empty. Throws
/// std::runtime_error.
Outcome readOutcome(pikort_pipeline *pipeline);

} // namespace piko::replay

#endif // PIKO_REPLAY_OUTCOME_H
