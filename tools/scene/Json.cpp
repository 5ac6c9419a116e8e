//===- Json.cpp - One line of JSON ----------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Json.h"

#include <charconv>
#include <cmath>
#include <cstdio>

using namespace piko::render;

/// The length of the character of UTF-8 that a text begins with (The Unicode
/// Standard, table 3-7), or 0 when it begins with none.
static size_t measureCharacter(std::string_view text) {
  auto at = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  unsigned char first = at(0);
  if (first < 0x80)
    return 1;
  size_t length = first < 0xC2   ? 0
                  : first < 0xE0 ? 2
                  : first < 0xF0 ? 3
                  : first < 0xF5 ? 4
                                 : 0;
  if (length == 0 || text.size() < length)
    return 0;
  // No longer form than needed, no surrogate, and nothing beyond U+10FFFF.
  unsigned char least = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  unsigned char most = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  if (at(1) < least || at(1) > most)
    return 0;
  for (size_t i = 2; i < length; ++i)
    if ((at(i) & 0xC0) != 0x80)
      return 0;
  return length;
}

static std::string quote(std::string_view text) {
  std::string quoted = "\"";
  while (!text.empty()) {
    size_t length = measureCharacter(text);
    unsigned char first = static_cast<unsigned char>(text[0]);
    if (length == 0) {
      quoted += "\uFFFD"; // U+FFFD, in UTF-8
      length = 1;
    } else if (first < 0x20) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\u%04x", first);
      quoted += escaped;
    } else {
      if (first == '"' || first == '\\')
        quoted += '\\';
      quoted += text.substr(0, length);
    }
    text.remove_prefix(length);
  }
  return quoted + '"';
}

JsonObject &JsonObject::add(std::string_view key, std::string_view value) {
  return addRaw(key, quote(value));
}

/// To a number of digits. Unlike printf it asks no locale.
static std::string write(double value, int digits) {
  if (!std::isfinite(value))
    return "null";
  char text[40];
  auto end = std::to_chars(text, text + sizeof text, value,
                           std::chars_format::general, digits);
  return {text, end.ptr};
}

JsonObject &JsonObject::add(std::string_view key, double value) {
  return addRaw(key, write(std::round(value * 1000) / 1000, 15));
}

JsonObject &JsonObject::addExact(std::string_view key, double value) {
  return addRaw(key, write(value, 9));
}

JsonObject &JsonObject::add(std::string_view key,
                            const std::vector<JsonObject> &values) {
  std::string list;
  for (const JsonObject &value : values)
    list += (list.empty() ? "" : ", ") + value.text();
  return addRaw(key, "[" + list + "]");
}

JsonObject &JsonObject::addRaw(std::string_view key, std::string_view value) {
  if (!members.empty())
    members += ", ";
  members += quote(key) + ": ";
  members += value;
  return *this;
}
