//===- PlyHeader.h - What a PLY file says that it holds ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_PLYHEADER_H
#define PIKO_TOOLS_SCENE_PLYHEADER_H

#include "Piko/Scene/Result.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace piko::render {

enum class PlyType { None, I8, U8, I16, U16, I32, U32, F32, F64 };

/// Bytes of a value.
int sizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType count = PlyType::None; ///< of a list's length; None = no list
  PlyType type = PlyType::None;
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// The place of a property, or -1.
  int find(std::string_view property, bool isList = false) const;
};

struct PlyHeader {
  std::string format;
  std::vector<PlyElement> elements;
  std::string_view data; ///< what is behind the header

  const PlyElement *find(std::string_view element) const;
};

/// Errors: a line that is none of a header, or no end of it; a format that
/// there is not; no vertices with positions, or no faces: then the error says
/// what the file holds instead.
Result<PlyHeader> readPlyHeader(std::string_view content);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_PLYHEADER_H
