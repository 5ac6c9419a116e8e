// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a run left in a pipeline's state.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_RESULT_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_RESULT_H

#include <cstdint>
#include <map>
#include <string>
#include <vector>

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

struct Result {
  std::map<std::string, Records> state;
  std::string error; ///< of a run that stopped; then there is no state

  bool isBlank() const;
};

/// Compares field by field, so that padding does not matter and all NaNs are
/// equal. Returns what differs, a line for each piece of state.
std::vector<std::string> compareResults(const Result &expected,
                                        const Result &actual);

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_RESULT_H
