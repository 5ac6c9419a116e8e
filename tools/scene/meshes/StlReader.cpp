//===- StlReader.cpp - Reads STL files ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Bytes.h"
#include "MeshBuilder.h"
#include "MeshReaders.h"

#include <glm/geometric.hpp>

using namespace piko;
using namespace piko::render;

namespace {

constexpr size_t stlHeader = 84, stlFacet = 50;

/// Adds a facet. A normal that has no direction is the triangle's own.
void addFacet(MeshBuilder &builder, glm::vec3 normal,
              const glm::vec3 (&corners)[3]) {
  glm::vec3 own = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  normal = normalizeOr(normal, normalizeOr(own, {0, 0, 1}));
  glm::ivec3 places;
  for (int k = 0; k < 3; ++k)
    places[k] = builder.addVertex(corners[k], normal, /*toJoin=*/true);
  builder.addTriangle(places);
}

Result<Mesh> readBinaryStl(std::string_view content) {
  if (content.size() < stlHeader)
    return Error{"it is no STL file: it has no facets"};
  uint64_t count = loadBytes<uint32_t>(content.data() + stlHeader - 4);
  std::string_view data = content.substr(stlHeader);
  if (count > data.size() / stlFacet)
    return Error{"it is cut short: it has room for " +
                 std::to_string(data.size() / stlFacet) + " of its " +
                 std::to_string(count) + " triangles"};
  MeshBuilder builder;
  if (size_t rest = data.size() - count * stlFacet)
    builder.warn(std::to_string(rest) +
                 " bytes after its last triangle are ignored");
  for (uint64_t i = 0; i < count && !builder.hasFailed(); ++i) {
    glm::vec3 vectors[4];
    for (int k = 0; k < 12; ++k)
      vectors[k / 3][k % 3] =
          loadBytes<float>(data.data() + i * stlFacet + size_t(k) * 4);
    addFacet(builder, vectors[0], {vectors[1], vectors[2], vectors[3]});
  }
  return builder.finish();
}

class StlText {
public:
  explicit StlText(std::string_view content) : whole(content), rest(content) {}

  Result<Mesh> read() {
    std::string_view word = take();
    bool isOpen = false;
    for (; !word.empty() && !builder.hasFailed(); word = take()) {
      if (is(word, "facet")) {
        if (!readFacet())
          return Error{problem};
        continue;
      }
      bool isStart = is(word, "solid");
      if (!isStart && !is(word, "endsolid") && !is(word, "end"))
        return Error{place() + "expected 'facet', but got " + quoteWord(word)};
      isOpen = isStart;
      skipLine(); // a name
    }
    if (isOpen)
      builder.warn("it ends without 'endsolid'");
    return builder.finish();
  }

private:
  std::string_view take() { return takeWord(rest); }

  void skipLine() {
    size_t end = rest.find_first_of("\r\n");
    rest.remove_prefix(end == rest.npos ? rest.size() : end);
  }

  static bool is(std::string_view word, std::string_view keyword) {
    return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                      [](char a, char b) {
                        return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b;
                      });
  }

  bool expect(std::string_view keyword) {
    std::string_view word = take();
    if (is(word, keyword))
      return true;
    return fail("'" + std::string(keyword) + "'", word);
  }

  bool readVector(glm::vec3 &v) {
    for (int k = 0; k < 3; ++k) {
      std::string_view word = take();
      if (!parseNumber(word, v[k]))
        return fail("a number", word);
    }
    return true;
  }

  bool readFacet() {
    glm::vec3 normal, corners[3];
    if (!expect("normal") || !readVector(normal) || !expect("outer") ||
        !expect("loop"))
      return false;
    for (glm::vec3 &corner : corners)
      if (!expect("vertex") || !readVector(corner))
        return false;
    if (!expect("endloop") || !expect("endfacet"))
      return false;
    addFacet(builder, normal, corners);
    return true;
  }

  bool fail(const std::string &expected, std::string_view word) {
    problem = word.empty() ? "it is cut short: expected " + expected
                           : place() + "expected " + expected + ", but got " +
                                 quoteWord(word);
    return false;
  }

  std::string place() const {
    std::string_view read = whole.substr(0, whole.size() - rest.size());
    bool isMac = read.find('\n') == read.npos;
    return "line " +
           std::to_string(
               std::count(read.begin(), read.end(), isMac ? '\r' : '\n') + 1) +
           ": ";
  }

  std::string_view whole, rest;
  MeshBuilder builder;
  std::string problem;
};

/// Whether a file is a text. Some binary ones begin as texts do, "solid": they
/// have the length that their count says, or bytes that no text has.
bool isStlText(std::string_view content) {
  if (content.size() >= stlHeader) {
    uint64_t count = loadBytes<uint32_t>(content.data() + stlHeader - 4);
    if (content.size() == stlHeader + count * stlFacet)
      return false;
  }
  std::string_view start = content.substr(0, 1024);
  if (start.find('\0') != start.npos)
    return false;
  std::string_view word = takeWord(start);
  return word.size() == 5 && (word[0] | 32) == 's' && (word[1] | 32) == 'o' &&
         (word[2] | 32) == 'l' && (word[3] | 32) == 'i' &&
         (word[4] | 32) == 'd';
}

} // namespace

Result<Mesh> render::readStl(std::string_view content) {
  if (isUtf16(content.substr(0, 2)) &&
      content.substr(0, 2).find('\0') == std::string_view::npos)
    return Error{"it is a text in UTF-16: save it as UTF-8"};
  if (content.starts_with(byteOrderMark))
    content.remove_prefix(byteOrderMark.size());
  return isStlText(content) ? StlText(content).read() : readBinaryStl(content);
}
