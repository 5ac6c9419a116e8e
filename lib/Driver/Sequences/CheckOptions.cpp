// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Driver/CheckOptions.h"

using namespace piko;

std::optional<CheckOptions> piko::parseCheckOptions(const std::string &text) {
  CheckOptions options;
  options.enabled = true;
  if (text.empty())
    return options;
  const std::string kind = "=nan:";
  if (!text.starts_with(kind))
    return std::nullopt;
  for (size_t begin = kind.size(); begin <= text.size();) {
    size_t end = std::min(text.find(',', begin), text.size());
    std::string field = text.substr(begin, end - begin);
    size_t dot = field.find('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == field.size())
      return std::nullopt;
    options.numbers.push_back(field);
    begin = end + 1;
  }
  return options;
}
