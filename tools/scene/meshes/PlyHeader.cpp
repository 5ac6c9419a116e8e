//===- PlyHeader.cpp - What a PLY file says that it holds -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PlyHeader.h"

#include "Bytes.h"

#include <algorithm>
#include <initializer_list>

using namespace piko;
using namespace piko::render;

namespace {

PlyType typeOf(std::string_view name) {
  struct Names {
    const char *first, *second;
    PlyType type;
  };
  constexpr Names all[] = {
      {"char", "int8", PlyType::I8},      {"uchar", "uint8", PlyType::U8},
      {"short", "int16", PlyType::I16},   {"ushort", "uint16", PlyType::U16},
      {"int", "int32", PlyType::I32},     {"uint", "uint32", PlyType::U32},
      {"float", "float32", PlyType::F32}, {"double", "float64", PlyType::F64}};
  for (const Names &names : all)
    if (name == names.first || name == names.second)
      return names.type;
  return PlyType::None;
}

std::string readElement(std::string_view line, PlyHeader &header) {
  PlyElement element;
  element.name = takeWord(line);
  if (!parseNumber(takeWord(line), element.count))
    return "its header has an element without a count";
  if (header.find(element.name))
    return "its header has two elements '" + element.name + "'";
  header.elements.push_back(std::move(element));
  return {};
}

std::string readProperty(std::string_view line, PlyHeader &header) {
  PlyProperty property;
  std::string_view word = takeWord(line);
  if (word == "list") {
    word = takeWord(line);
    property.count = typeOf(word);
    if (property.count == PlyType::None || property.count >= PlyType::F32)
      return "its header has a list whose length has the type " +
             quoteWord(word);
    word = takeWord(line);
  }
  property.type = typeOf(word);
  if (property.type == PlyType::None)
    return "its header has a property of the unknown type " + quoteWord(word);
  property.name = takeWord(line);
  if (header.elements.empty())
    return "its header has a property before any element";
  header.elements.back().properties.push_back(std::move(property));
  return {};
}

/// Reads one line of the header; the result is what is wrong.
std::string readLine(std::string_view line, PlyHeader &header) {
  std::string_view rest = line, word = takeWord(rest);
  if (word == "format") {
    header.format = takeWord(rest);
    if (std::string_view version = takeWord(rest); version != "1.0")
      return "expected version 1.0 of PLY, but got " + quoteWord(version);
    return {};
  }
  if (word == "element")
    return readElement(rest, header);
  if (word == "property")
    return readProperty(rest, header);
  if (word.empty() || word == "comment" || word == "obj_info")
    return {};
  return "its header has the unknown line " + quoteWord(line);
}

/// Takes lines up to the header's end. They all end as the first does: the
/// first byte of the data may be one that ends lines, too.
std::string readLines(std::string_view content, PlyHeader &header) {
  std::string_view lineEnd = "\n";
  size_t first = content.find_first_of("\r\n");
  if (first == content.npos)
    return content.starts_with("ply") ? "its header has no end"
                                      : "it is no PLY file";
  if (content[first] == '\r')
    lineEnd = content.substr(first).starts_with("\r\n") ? "\r\n" : "\r";
  for (bool isFirst = true;; isFirst = false) {
    size_t end = content.find(lineEnd);
    if (end == content.npos)
      return "its header has no end";
    std::string_view line = content.substr(0, end);
    while (!line.empty() && isBlank(line.back()))
      line.remove_suffix(1);
    content.remove_prefix(end + lineEnd.size());
    if (isFirst && line != "ply")
      return "it is no PLY file: its first line is not 'ply'";
    if (line == "end_header") {
      header.data = content;
      return {};
    }
    if (isFirst)
      continue;
    if (std::string problem = readLine(line, header); !problem.empty())
      return problem;
  }
}

bool hasProperties(const PlyElement &element,
                   std::initializer_list<std::string_view> names) {
  return std::ranges::all_of(
      names, [&](std::string_view name) { return element.find(name) >= 0; });
}

/// What a file without faces holds instead; "" if it has faces.
std::string findNoMesh(const PlyHeader &header) {
  for (const char *name : {"face", "tristrips"})
    if (const PlyElement *faces = header.find(name); faces && faces->count)
      return {};
  const PlyElement *vertices = header.find("vertex");
  if (!vertices || !vertices->count)
    return {};
  std::string kind = "points without faces";
  if (header.find("range_grid"))
    kind = "points of a range grid";
  else if (hasProperties(*vertices, {"f_dc_0", "opacity", "scale_0", "rot_0"}))
    kind = "Gaussian splats";
  else if (header.find("chunk") &&
           hasProperties(*vertices, {"packed_position", "packed_scale"}))
    kind = "packed Gaussian splats (.compressed.ply)";
  return "expected triangles, but it holds " + std::to_string(vertices->count) +
         " " + kind +
         ", which are not supported as a scene: feed them to a pipeline from "
         "an application";
}

/// What is wrong with a header that is whole.
std::string findProblem(const PlyHeader &header) {
  if (header.format != "ascii" && header.format != "binary_big_endian" &&
      header.format != "binary_little_endian")
    return "its header has the unknown format " + quoteWord(header.format);
  if (std::string problem = findNoMesh(header); !problem.empty())
    return problem;
  const PlyElement *vertices = header.find("vertex");
  if (!vertices)
    return "its header has no element 'vertex'";
  for (const char *name : {"x", "y", "z"})
    if (vertices->find(name) < 0)
      return std::string("its element 'vertex' has no property '") + name + "'";
  for (const char *name : {"face", "tristrips"})
    if (const PlyElement *faces = header.find(name))
      if (faces->count && faces->find("vertex_indices", true) < 0 &&
          faces->find("vertex_index", true) < 0)
        return std::string("its element '") + name +
               "' has no list 'vertex_indices'";
  return {};
}

} // namespace

int render::sizeOf(PlyType type) {
  constexpr int sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[int(type)];
}

int PlyElement::find(std::string_view property, bool isList) const {
  for (size_t i = 0; i < properties.size(); ++i)
    if (properties[i].name == property &&
        (properties[i].count != PlyType::None) == isList)
      return int(i);
  return -1;
}

const PlyElement *PlyHeader::find(std::string_view element) const {
  auto found = std::ranges::find(elements, element, &PlyElement::name);
  return found == elements.end() ? nullptr : &*found;
}

Result<PlyHeader> render::readPlyHeader(std::string_view content) {
  PlyHeader header;
  std::string problem = isUtf16(content)
                            ? "it is a text in UTF-16: save it as UTF-8"
                            : readLines(content, header);
  if (problem.empty())
    problem = findProblem(header);
  if (!problem.empty())
    return Error{problem};
  return header;
}
