//===- PlyCheck.cpp - Whether a PLY file is a whole mesh ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reads the header, then walks over the data without keeping any of it.
//
//===----------------------------------------------------------------------===//
#include "PlyCheck.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <sstream>
#include <vector>

using namespace piko;

namespace {

struct Property {
  std::string name;
  int countSize = 0; ///< bytes of a list's length; 0 = no list
  int size = 0;      ///< bytes of a value
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::string_view data;
};

int sizeOfType(const std::string &type) {
  for (const char *name : {"char", "uchar", "int8", "uint8"})
    if (type == name)
      return 1;
  for (const char *name : {"short", "ushort", "int16", "uint16"})
    if (type == name)
      return 2;
  for (const char *name :
       {"int", "uint", "int32", "uint32", "float", "float32"})
    if (type == name)
      return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

/// Reads one line of the header; the result is what is wrong.
std::string readLine(const std::string &line, Header &header) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (word == "format") {
    words >> header.format;
  } else if (word == "element") {
    Element element;
    words >> element.name >> element.count;
    if (!words)
      return "its header has an element without a count";
    header.elements.push_back(element);
  } else if (word == "property") {
    Property property;
    words >> word;
    if (word == "list") {
      words >> word;
      property.countSize = sizeOfType(word);
      if (property.countSize == 0 || property.countSize == 8)
        return "its header has a list whose length has the type '" + word + "'";
      words >> word;
    }
    property.size = sizeOfType(word);
    if (property.size == 0)
      return "its header has a property of the unknown type '" + word + "'";
    words >> property.name;
    if (header.elements.empty())
      return "its header has a property before any element";
    header.elements.back().properties.push_back(property);
  } else if (word != "comment" && word != "obj_info" && word != "ply" &&
             !word.empty()) {
    return "its header has the unknown line '" + line.substr(0, 40) + "'";
  }
  return {};
}

std::string readHeader(std::string_view content, Header &header) {
  while (true) {
    size_t end = content.find('\n');
    if (end == std::string_view::npos)
      return "its header has no end";
    std::string line(content.substr(0, end));
    content.remove_prefix(end + 1);
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (line == "end_header") {
      header.data = content;
      return {};
    }
    if (std::string problem = readLine(line, header); !problem.empty())
      return problem;
  }
}

/// Whether binary data holds all elements.
bool isBinaryWhole(std::string_view data, const std::vector<Element> &elements,
                   bool isBigEndian) {
  auto take = [&](uint64_t bytes) {
    if (data.size() < bytes)
      return false;
    data.remove_prefix(bytes);
    return true;
  };
  auto takeList = [&](const Property &list) {
    if (data.size() < size_t(list.countSize))
      return false;
    uint64_t length = 0;
    for (int i = 0; i < list.countSize; ++i) {
      int byte = isBigEndian ? i : list.countSize - 1 - i;
      length = length << 8 | static_cast<unsigned char>(data[byte]);
    }
    return take(list.countSize) && take(length * list.size);
  };
  for (const Element &element : elements)
    for (uint64_t i = 0; i < element.count; ++i) {
      if (element.properties.empty())
        break;
      for (const Property &property : element.properties)
        if (!(property.countSize ? takeList(property) : take(property.size)))
          return false;
    }
  return true;
}

/// Whether a text holds at least one line for each element.
bool isTextWhole(std::string_view data, const std::vector<Element> &elements) {
  uint64_t expected = 0;
  for (const Element &element : elements)
    expected += element.count;
  bool endsInLine = !data.empty() && data.back() != '\n';
  return uint64_t(std::count(data.begin(), data.end(), '\n')) + endsInLine >=
         expected;
}

const Element *find(const Header &header, std::string_view name) {
  auto found = std::ranges::find(header.elements, name, &Element::name);
  return found == header.elements.end() ? nullptr : &*found;
}

bool hasProperties(const Element &element,
                   std::initializer_list<std::string_view> names) {
  return std::ranges::all_of(names, [&](std::string_view name) {
    return std::ranges::count(element.properties, name, &Property::name) > 0;
  });
}

/// What a file without faces holds instead; "" if it has faces.
std::string findNoMesh(const Header &header) {
  for (const char *name : {"face", "tristrips"})
    if (const Element *faces = find(header, name); faces && faces->count)
      return {};
  const Element *vertices = find(header, "vertex");
  if (!vertices || !vertices->count)
    return {};
  std::string kind = "points without faces";
  if (hasProperties(*vertices, {"f_dc_0", "opacity", "scale_0", "rot_0"}))
    kind = "Gaussian splats";
  else if (find(header, "chunk") &&
           hasProperties(*vertices, {"packed_position", "packed_scale"}))
    kind = "packed Gaussian splats (.compressed.ply)";
  return "expected triangles, but it holds " + std::to_string(vertices->count) +
         " " + kind +
         ", which are not supported as a scene: feed them to a pipeline from "
         "an application";
}

} // namespace

std::string render::checkPly(std::string_view content) {
  Header header;
  if (std::string problem = readHeader(content, header); !problem.empty())
    return problem;
  bool isText = header.format == "ascii";
  bool isBigEndian = header.format == "binary_big_endian";
  if (!isText && !isBigEndian && header.format != "binary_little_endian")
    return "its header has the unknown format '" + header.format + "'";
  if (std::string problem = findNoMesh(header); !problem.empty())
    return problem;
  bool isWhole = isText
                     ? isTextWhole(header.data, header.elements)
                     : isBinaryWhole(header.data, header.elements, isBigEndian);
  return isWhole ? "" : "it is cut short";
}
