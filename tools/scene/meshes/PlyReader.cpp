//===- PlyReader.cpp - Reads PLY files ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Bytes.h"
#include "MeshBuilder.h"
#include "MeshReaders.h"
#include "PlyHeader.h"

#include <array>
#include <cmath>

using namespace piko;
using namespace piko::render;

namespace {

/// Reads values one after another, all of them as numbers that hold each.
class PlyValues {
public:
  PlyValues(std::string_view data, const std::string &format)
      : data(data), isText(format == "ascii"),
        isBigEndian(format == "binary_big_endian") {}

  bool read(PlyType type, double &value) {
    if (isText) {
      std::string_view word = takeWord(data);
      if (word.empty())
        return fail("it is cut short");
      if (!parseNumber(word, value))
        return fail("expected a number, but got " + quoteWord(word));
      return true;
    }
    if (data.size() < size_t(sizeOf(type)))
      return fail("it is cut short");
    value = load(type);
    data.remove_prefix(size_t(sizeOf(type)));
    return true;
  }

  /// Whether the data can hold so many values that take at least `bytes`.
  bool canHold(uint64_t count, uint64_t bytes) const {
    uint64_t least = isText ? 1 : bytes; // a digit
    return least == 0 || count <= data.size() / least;
  }

  bool fail(const std::string &message) {
    problem = message;
    return false;
  }

  /// Bytes that are left but blanks.
  size_t countRest() const {
    size_t rest = 0;
    for (char c : data)
      rest += !isBlank(c);
    return rest;
  }

  std::string problem;

private:
  double load(PlyType type) const {
    const char *bytes = data.data();
    switch (type) {
    case PlyType::I8:
      return loadBytes<int8_t>(bytes);
    case PlyType::U8:
      return loadBytes<uint8_t>(bytes);
    case PlyType::I16:
      return loadBytes<int16_t>(bytes, isBigEndian);
    case PlyType::U16:
      return loadBytes<uint16_t>(bytes, isBigEndian);
    case PlyType::I32:
      return loadBytes<int32_t>(bytes, isBigEndian);
    case PlyType::U32:
      return loadBytes<uint32_t>(bytes, isBigEndian);
    case PlyType::F32:
      return loadBytes<float>(bytes, isBigEndian);
    case PlyType::F64:
      return loadBytes<double>(bytes, isBigEndian);
    case PlyType::None:
      break;
    }
    return 0;
  }

  std::string_view data;
  bool isText, isBigEndian;
};

/// Polygons, or strips, one after the other.
struct PlyLists {
  std::vector<size_t> ends;
  std::vector<int32_t> indices;
};

class PlyReader {
public:
  explicit PlyReader(const PlyHeader &header)
      : header(header), values(header.data, header.format) {}

  Result<Mesh> read() {
    for (const PlyElement &element : header.elements)
      if (!readElement(element))
        return Error{values.problem};
    if (size_t rest = values.countRest())
      builder.warn(std::to_string(rest) +
                   " bytes after its last element are ignored");
    findShared();
    places.assign(positions.size(), -1);
    addFaces();
    addStrips();
    return builder.finish();
  }

private:
  bool readElement(const PlyElement &element) {
    uint64_t least = 0;
    for (const PlyProperty &property : element.properties)
      least += uint64_t(sizeOf(
          property.count == PlyType::None ? property.type : property.count));
    if (element.properties.empty())
      return true;
    if (!values.canHold(element.count, least))
      return values.fail("it is cut short: it has no room for " +
                         std::to_string(element.count) + " of its element '" +
                         element.name + "'");
    if (element.name == "vertex")
      return readVertices(element);
    bool isStrips = element.name == "tristrips";
    PlyLists *lists = isStrips                 ? &strips
                      : element.name == "face" ? &faces
                                               : nullptr;
    int list = element.find("vertex_indices", true);
    if (list < 0)
      list = element.find("vertex_index", true);
    for (uint64_t i = 0; i < element.count; ++i) {
      for (int p = 0; p < int(element.properties.size()); ++p)
        if (!readProperty(element, i, p, p == list ? lists : nullptr))
          return false;
      if (lists)
        lists->ends.push_back(lists->indices.size());
    }
    return true;
  }

  bool readVertices(const PlyElement &element) {
    constexpr const char *names[] = {"x", "y", "z", "nx", "ny", "nz"};
    std::vector<int> targets(element.properties.size(), -1);
    bool hasNormals = true;
    for (int k = 0; k < 6; ++k) {
      int p = element.find(names[k]);
      hasNormals &= p >= 0;
      if (p >= 0)
        targets[p] = k;
    }
    positions.reserve(element.count);
    for (uint64_t i = 0; i < element.count; ++i) {
      std::array<float, 7> vertex{}; // the last for what is ignored
      for (int p = 0; p < int(targets.size()); ++p) {
        double value = 0;
        if (element.properties[p].count != PlyType::None) {
          if (!readProperty(element, i, p, nullptr))
            return false;
          continue;
        }
        if (!values.read(element.properties[p].type, value))
          return failAt(element, i);
        vertex[targets[p] < 0 ? 6 : targets[p]] = toFloat(value);
      }
      positions.emplace_back(vertex[0], vertex[1], vertex[2]);
      if (hasNormals)
        normals.emplace_back(vertex[3], vertex[4], vertex[5]);
    }
    return true;
  }

  static float toFloat(double value) {
    // The conversion of what no float holds is not defined.
    constexpr double most = std::numeric_limits<float>::max();
    if (std::abs(value) > most)
      return std::copysign(std::numeric_limits<float>::infinity(),
                           float(value > 0) - float(value < 0));
    return float(value);
  }

  bool readProperty(const PlyElement &element, uint64_t i, int p,
                    PlyLists *lists) {
    const PlyProperty &property = element.properties[p];
    double count = 1, value = 0;
    if (property.count != PlyType::None) {
      if (!values.read(property.count, count))
        return failAt(element, i);
      if (!(count >= 0) || count != std::floor(count))
        return values.fail("expected the length of a list, but got " +
                           describe(count)) ||
               failAt(element, i);
      if (count >= 4294967296.0 ||
          !values.canHold(uint64_t(count), uint64_t(sizeOf(property.type))))
        return values.fail("it is cut short") || failAt(element, i);
    }
    for (uint64_t k = 0; k < uint64_t(count); ++k) {
      if (!values.read(property.type, value))
        return failAt(element, i);
      if (lists && !addIndex(*lists, element, i, value))
        return false;
    }
    return true;
  }

  bool addIndex(PlyLists &lists, const PlyElement &element, uint64_t i,
                double value) {
    uint64_t count = header.find("vertex")->count;
    bool isRestart = value == -1 && &lists == &strips;
    if (!isRestart && !(value >= 0 && value < double(count) &&
                        value < 2147483647.0 && value == std::floor(value)))
      return values.fail("element '" + element.name + "' " + std::to_string(i) +
                         " names vertex " + describe(value) + " of " +
                         std::to_string(count));
    lists.indices.push_back(int32_t(value));
    return true;
  }

  static std::string describe(double value) {
    if (value == std::floor(value) && std::abs(value) < 1e15)
      return std::to_string(int64_t(value));
    return std::to_string(value);
  }

  bool failAt(const PlyElement &element, uint64_t i) {
    return values.fail(values.problem + ", at '" + element.name + "' " +
                       std::to_string(i));
  }

  /// Whether two faces share a vertex. Where none do, equal ones are joined.
  void findShared() {
    std::vector<bool> isUsed(positions.size());
    for (const PlyLists *lists : {&faces, &strips})
      for (int32_t i : lists->indices)
        if (i >= 0) {
          toJoin &= !isUsed[i];
          isUsed[i] = true;
        }
    toJoin &= strips.indices.empty();
  }

  int32_t place(int32_t i) {
    if (places[i] < 0)
      places[i] = builder.addVertex(
          positions[i],
          normals.empty() ? glm::vec3(0) : normalizeOr(normals[i], {0, 0, 1}),
          toJoin);
    return places[i];
  }

  void addFaces() {
    std::vector<int32_t> corners;
    size_t first = 0;
    for (size_t end : faces.ends) {
      corners.clear();
      if (end - first >= 3)
        for (size_t i = first; i < end; ++i)
          corners.push_back(place(faces.indices[i]));
      builder.addPolygon(corners);
      first = end;
    }
  }

  void addStrips() {
    size_t first = 0;
    for (size_t end : strips.ends) {
      size_t start = first;
      for (size_t i = first; i < end; ++i) {
        if (strips.indices[i] < 0)
          start = i + 1;
        if (i < start + 2)
          continue;
        int32_t a = place(strips.indices[i - 2]);
        int32_t b = place(strips.indices[i - 1]);
        int32_t c = place(strips.indices[i]);
        bool isTurned = (i - start) % 2 == 1;
        builder.addTriangle(isTurned ? glm::ivec3(b, a, c)
                                     : glm::ivec3(a, b, c));
      }
      first = end;
    }
  }

  const PlyHeader &header;
  PlyValues values;
  std::vector<glm::vec3> positions, normals;
  PlyLists faces, strips;
  bool toJoin = true;
  std::vector<int32_t> places;
  MeshBuilder builder;
};

} // namespace

Result<Mesh> render::readPly(std::string_view content) {
  auto header = readPlyHeader(content);
  if (!header)
    return header.error();
  return PlyReader(*header).read();
}
