//===- Json.cpp - One line of JSON ----------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Json.h"

#include <cmath>
#include <cstdio>

using namespace piko::render;

static std::string quote(std::string_view text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\u%04x", c);
      quoted += escaped;
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

JsonObject &JsonObject::add(std::string_view key, std::string_view value) {
  return addRaw(key, quote(value));
}

static std::string write(double value, const char *format) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return std::isfinite(value) ? text : "null";
}

JsonObject &JsonObject::add(std::string_view key, double value) {
  return addRaw(key, write(std::round(value * 1000) / 1000, "%.15g"));
}

JsonObject &JsonObject::addExact(std::string_view key, double value) {
  return addRaw(key, write(value, "%.9g"));
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
