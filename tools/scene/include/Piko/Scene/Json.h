//===- Json.h - One line of JSON --------------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_JSON_H
#define PIKO_SCENE_JSON_H

#include <nlohmann/json.hpp>

#include <string>

namespace piko::render {

/// Members keep their order.
using Json = nlohmann::ordered_json;

/// So that a report has no digits that mean nothing; a whole number has no
/// point.
Json roundToThousandths(double value);

/// One line, with a space after each comma and colon, and without a line end.
/// Numbers that are not finite become null. Bytes that are not UTF-8, as in
/// names of files, become U+FFFD, the replacement character.
std::string writeLine(const Json &json);

} // namespace piko::render

#endif // PIKO_SCENE_JSON_H
