// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What to check while a pipeline runs: `--check[=nan:Record.field,...]`.

#ifndef PIKO_DRIVER_CHECKOPTIONS_H
#define PIKO_DRIVER_CHECKOPTIONS_H

#include <optional>
#include <string>
#include <vector>

namespace piko {

struct CheckOptions {
  /// Whether the rules of state are checked at all.
  bool enabled = false;
  /// Fields that must not be NaN, as Record.field.
  std::vector<std::string> numbers;
};

/// Reads what follows `--check`, empty if nothing does; none if it is not
/// `=nan:Record.field,...`.
std::optional<CheckOptions> parseCheckOptions(const std::string &text);

} // namespace piko

#endif // PIKO_DRIVER_CHECKOPTIONS_H
