//===- Json.h - One line of JSON --------------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_JSON_H
#define PIKO_SCENE_JSON_H

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace piko::render {

/// A JSON object whose members keep their order. Numbers that are not finite
/// become null. Bytes that are not UTF-8, as in names of files, each become
/// U+FFFD, the replacement character. The locale makes no difference.
class JsonObject {
public:
  JsonObject &add(std::string_view key, std::string_view value);
  JsonObject &add(std::string_view key, const char *value) {
    return add(key, std::string_view(value));
  }
  /// Rounded to thousandths.
  JsonObject &add(std::string_view key, double value);
  /// To nine digits.
  JsonObject &addExact(std::string_view key, double value);
  JsonObject &add(std::string_view key, std::integral auto value) {
    return addRaw(key, std::to_string(value));
  }
  JsonObject &add(std::string_view key, const JsonObject &value) {
    return addRaw(key, value.text());
  }
  JsonObject &add(std::string_view key, const std::vector<JsonObject> &values);

  /// The object on one line, without a line end.
  std::string text() const { return "{" + members + "}"; }

private:
  JsonObject &addRaw(std::string_view key, std::string_view value);
  std::string members;
};

} // namespace piko::render

#endif // PIKO_SCENE_JSON_H
