// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Type.cpp - Types of PTX --------------------------------------------===//

#include "ptx/text/Type.h"

using namespace piko::ptx;

std::optional<Type> piko::ptx::parseType(std::string_view name) {
  if (name == "pred")
    return Type{Kind::Predicate, 1};
  if (name.size() < 2)
    return std::nullopt;
  std::string_view bits = name.substr(1);
  uint8_t width = bits == "8"    ? 8
                  : bits == "16" ? 16
                  : bits == "32" ? 32
                  : bits == "64" ? 64
                                 : 0;
  if (!width)
    return std::nullopt;
  switch (name[0]) {
  case 'b':
    return Type{Kind::Bits, width};
  case 'u':
    return Type{Kind::Unsigned, width};
  case 's':
    return Type{Kind::Signed, width};
  case 'f':
    if (width >= 16)
      return Type{Kind::Float, width};
    [[fallthrough]];
  default:
    return std::nullopt;
  }
}

std::optional<Space> piko::ptx::parseSpace(std::string_view name) {
  if (name == "global")
    return Space::Global;
  if (name == "const")
    return Space::Const;
  if (name == "shared")
    return Space::Shared;
  if (name == "local")
    return Space::Local;
  if (name == "param")
    return Space::Param;
  return std::nullopt;
}

const char *piko::ptx::nameOf(Space space) {
  switch (space) {
  case Space::Global:
    return "global";
  case Space::Const:
    return "constant";
  case Space::Shared:
    return "shared";
  case Space::Local:
    return "local";
  case Space::Param:
    return "parameter";
  case Space::Generic:
    break;
  }
  return "generic";
}
