//===- Json.cpp - One line of JSON ----------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Json.h"

#include <cmath>

using namespace piko;

Json render::roundToThousandths(double value) {
  double rounded = std::round(value * 1000) / 1000;
  if (std::abs(rounded) < 1e15 && rounded == std::trunc(rounded))
    return int64_t(rounded);
  return rounded;
}

std::string render::writeLine(const Json &json) {
  // Line ends are between members alone: those of texts are escaped.
  std::string lines =
      json.dump(/*indent=*/0, ' ', false, Json::error_handler_t::replace);
  std::string line;
  for (char c : lines)
    if (c != '\n')
      line += c;
    else if (line.back() == ',')
      line += ' ';
  return line;
}
