//===- ObjReader.cpp - Reads Wavefront OBJ files --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Bytes.h"
#include "MeshBuilder.h"
#include "MeshReaders.h"
#include "Vectors.h"

#include <algorithm>

using namespace piko;
using namespace piko::render;

namespace {

/// Takes lines without their comments, and those that a backslash continues as
/// one.
class ObjLines {
public:
  explicit ObjLines(std::string_view content) : rest(content) {}

  /// \returns false at the end.
  bool next(std::string_view &line) {
    if (rest.empty())
      return false;
    number += passed;
    passed = 0;
    bool isContinued;
    line = takeLine(isContinued);
    if (!isContinued)
      return true;
    whole = line;
    while (isContinued && !rest.empty())
      (whole += ' ') += takeLine(isContinued);
    line = whole;
    return true;
  }

  size_t number = 1; ///< of the line, or of the first of those continued

private:
  std::string_view takeLine(bool &isContinued) {
    size_t end = rest.find_first_of("\r\n");
    std::string_view line = rest.substr(0, end);
    size_t ending = end == rest.npos                       ? 0
                    : rest.substr(end).starts_with("\r\n") ? 2
                                                           : 1;
    rest.remove_prefix(line.size() + ending);
    ++passed;
    line = line.substr(0, line.find('#'));
    isContinued = line.ends_with('\\');
    line.remove_suffix(isContinued);
    return line;
  }

  std::string_view rest;
  std::string whole;
  size_t passed = 0;
};

constexpr std::string_view curves[] = {
    "vp",    "cstype", "deg",  "bmat", "step", "curv", "curv2", "surf",
    "parm",  "trim",   "hole", "scrv", "sp",   "end",  "con",   "ctech",
    "stech", "bzp",    "bsp",  "cdc",  "cdp",  "res"};

/// What says nothing of the shape.
constexpr std::string_view silent[] = {
    "vt",     "g",        "s",        "o",          "mg",
    "usemtl", "mtllib",   "usemap",   "maplib",     "lod",
    "bevel",  "c_interp", "d_interp", "shadow_obj", "trace_obj"};

class ObjReader {
public:
  Result<Mesh> read(std::string_view content) {
    ObjLines lines(content);
    std::string_view line;
    while (problem.empty() && lines.next(line)) {
      number = lines.number;
      std::string_view word = takeWord(line);
      if (!word.empty())
        readStatement(word, line);
    }
    if (problem.empty() && !isObj)
      problem = "it is no OBJ file: it has no vertices and no faces";
    if (problem.empty())
      addFaces();
    if (!problem.empty())
      return Error{problem};
    return builder.finish();
  }

private:
  struct Corner {
    int64_t position, normal; ///< normal -1 = none
  };
  struct Face {
    size_t end, line;
  };

  void readStatement(std::string_view word, std::string_view rest) {
    if (word == "v")
      return readVector(rest, positions);
    if (word == "vn")
      return readVector(rest, normals);
    if (word == "f" || word == "fo")
      return readFace(rest);
    if (word == "l" || word == "p")
      return builder.warn("its lines and points are left out");
    if (std::ranges::count(silent, word))
      return;
    if (std::ranges::count(curves, word))
      return builder.warn("its curves and surfaces are left out");
    if (word == "call" || word == "csh")
      return builder.warn("line " + std::to_string(number) + ": '" +
                          std::string(word) + "' is left out");
    if (!hasUnknown)
      builder.warn("line " + std::to_string(number) +
                   ": the unknown statement " + quoteWord(word) +
                   " and others like it are left out");
    hasUnknown = true;
  }

  void readVector(std::string_view rest, std::vector<glm::vec3> &vectors) {
    isObj = true;
    glm::vec3 v(0);
    for (int k = 0; k < 3; ++k)
      if (!readNumber(takeWord(rest), v[k]))
        return;
    // A weight, or a colour.
    float ignored;
    for (std::string_view word = takeWord(rest); !word.empty();
         word = takeWord(rest))
      if (!readNumber(word, ignored))
        return;
    if (&vectors == &positions && !isFinite(v))
      return fail("the position of a vertex is not finite");
    vectors.push_back(v);
  }

  bool readNumber(std::string_view word, float &value) {
    if (parseNumber(word, value))
      return true;
    fail(word.empty() ? "expected three numbers, but got fewer"
                      : "expected a number, but got " + quoteWord(word));
    return false;
  }

  void readFace(std::string_view rest) {
    isObj = true;
    size_t first = corners.size();
    for (std::string_view word = takeWord(rest); !word.empty();
         word = takeWord(rest)) {
      Corner corner{-1, -1};
      if (!readCorner(word, corner))
        return fail("expected a vertex as 1, 1/1, 1//1 or 1/1/1, but got " +
                    quoteWord(word));
      if (!problem.empty())
        return;
      corners.push_back(corner);
    }
    if (corners.size() - first < 3)
      corners.resize(first);
    faces.push_back({corners.size(), number});
  }

  bool readCorner(std::string_view word, Corner &corner) {
    size_t slash = word.find('/');
    if (!readIndex(word.substr(0, slash), positions.size(), corner.position))
      return false;
    if (slash == word.npos)
      return true;
    word.remove_prefix(slash + 1);
    slash = word.find('/');
    std::string_view texture = word.substr(0, slash);
    int64_t ignored;
    if (!texture.empty() && !readIndex(texture, 0, ignored, false))
      return false;
    if (slash == word.npos)
      return true;
    word.remove_prefix(slash + 1);
    return word.empty() || readIndex(word, normals.size(), corner.normal);
  }

  /// Reads an index, from 1 on, or back from the last one of `known`.
  bool readIndex(std::string_view word, size_t known, int64_t &index,
                 bool isUsed = true) {
    int64_t value;
    if (!parseNumber(word, value))
      return false;
    if (value == 0)
      fail("expected an index from 1 on or below 0, but got 0");
    else if (isUsed && value < 0 && -value > int64_t(known))
      fail("index " + std::to_string(value) + " of " + std::to_string(known) +
           " that are before it is out of range");
    index = value > 0 ? value - 1 : int64_t(known) + value;
    return true;
  }

  void addFaces() {
    cached.assign(positions.size(), {-1, -1});
    std::vector<int32_t> places;
    size_t first = 0;
    for (const Face &face : faces) {
      number = face.line;
      places.clear();
      for (size_t i = first; i < face.end && problem.empty(); ++i)
        places.push_back(place(corners[i]));
      if (!problem.empty())
        return;
      builder.addPolygon(places);
      first = face.end;
    }
  }

  int32_t place(Corner corner) {
    if (corner.position >= int64_t(positions.size()) ||
        corner.normal >= int64_t(normals.size())) {
      bool isPosition = corner.position >= int64_t(positions.size());
      fail("index " +
           std::to_string((isPosition ? corner.position : corner.normal) + 1) +
           " of " +
           std::to_string(isPosition ? positions.size() : normals.size()) +
           (isPosition ? " vertices" : " normals") + " is out of range");
      return 0;
    }
    Cached &last = cached[size_t(corner.position)];
    if (last.place < 0 || last.normal != corner.normal) {
      glm::vec3 normal(0);
      if (corner.normal >= 0)
        normal = normalizeOr(normals[size_t(corner.normal)], {0, 0, 1});
      last = {corner.normal,
              builder.addVertex(positions[size_t(corner.position)], normal,
                                /*toJoin=*/true)};
    }
    return last.place;
  }

  void fail(const std::string &message) {
    if (problem.empty())
      problem = "line " + std::to_string(number) + ": " + message;
  }

  /// Where a vertex was last added, and with which normal.
  struct Cached {
    int64_t normal;
    int32_t place;
  };

  std::vector<glm::vec3> positions, normals;
  std::vector<Corner> corners;
  std::vector<Face> faces;
  std::vector<Cached> cached;
  MeshBuilder builder;
  bool isObj = false, hasUnknown = false;
  size_t number = 0;
  std::string problem;
};

} // namespace

Result<Mesh> render::readObj(std::string_view content) {
  if (isUtf16(content))
    return Error{"it is a text in UTF-16: save it as UTF-8"};
  if (content.starts_with(byteOrderMark))
    content.remove_prefix(byteOrderMark.size());
  return ObjReader().read(content);
}
