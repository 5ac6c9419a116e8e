//===- MeshReadersTest.cpp - What PLY, OBJ and STL files may say ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "MeshReaders.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

using namespace piko::render;

namespace {

/// What a file gives: "T triangles, area A", what faces +z less what faces -z
/// as A, or an error; and its warnings.
std::string describe(const Result<Mesh> &mesh) {
  if (!mesh)
    return mesh.error().message;
  double area = 0;
  for (const auto &t : mesh->triangles) {
    glm::vec3 a = mesh->vertices[t.vertex.x].position;
    glm::vec3 b = mesh->vertices[t.vertex.y].position;
    glm::vec3 c = mesh->vertices[t.vertex.z].position;
    area += glm::cross(b - a, c - a).z / 2;
  }
  std::string text = std::to_string(mesh->triangles.size()) + " of " +
                     std::to_string(std::lround(area * 100)) + "%";
  for (const std::string &warning : mesh->warnings)
    text += "; " + warning;
  return text;
}

struct Case {
  const char *content, *expected;
};

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(ObjReader, Faces) {
  const Case cases[] = {
      {"f 1 2 3 4 # quad", "2 of 100%"},
      {"f 1 2 3 4#quad", "2 of 100%"},
      {"f 1 2 \\\n 3 4", "2 of 100%"},
      {"f\t1\t2\t3\r\nf 1 3 4\r\n", "2 of 100%"},
      {"f -4 -3 -2 -1", "2 of 100%"},
      {"vt 0 0\nf 1/1 2/1 3/1 4/1", "2 of 100%"},
      {"vn 0 0 1\nf 1//1 2 3//-1 4", "2 of 100%"},
      {"f 1 2 2 3 4 4", "2 of 100%"},
      {"f\nf 1\nf 1 2\nf 1 2 3", "1 of 50%"},
      {"f 5 6 7\nv 0 0 0\nv +2. 0 0\nv 0 2e0 0", "1 of 200%"},
      {"o a b\ng\ns off\nusemtl x\nmtllib c:\\d\nf 1 2 3", "1 of 50%"},
      {"l 1 2\nf 1 2 3", "1 of 50%; its lines and points are left out"},
      {"curv 0 1 1 2\nsurf 0 1 0 1 1 2\nf 1 2 3",
       "1 of 50%; its curves and surfaces are left out"},
      {"call a.obj\nf 1 2 3", "1 of 50%; line 5: 'call' is left out"},
      {"f 1 2 9", "line 5: index 9 of 4 vertices is out of range"},
      {"f 1//1 2//1 3//1", "line 5: index 1 of 0 normals is out of range"},
      {"\nf 1 2 -5",
       "line 6: index -5 of 4 that are before it is out of range"},
      {"f 0 1 2", "line 5: expected an index from 1 on or below 0, but got 0"},
      {"v nan 0 0", "line 5: the position of a vertex is not finite"},
      {"v 1e39 0 0", "line 5: the position of a vertex is not finite"},
      {"v 0,5 0 0", "line 5: expected a number, but got '0,5'"},
      {"v 1 2", "line 5: expected three numbers, but got fewer"},
      {"f 1 2 x",
       "line 5: expected a vertex as 1, 1/1, 1//1 or 1/1/1, but got 'x'"}};
  for (const Case &one : cases)
    EXPECT_EQ(describe(readObj(square + one.content)), one.expected)
        << one.content;
  EXPECT_EQ(describe(readObj("\xef\xbb\xbf" + square + "f 1 2 3 4")),
            "2 of 100%");
  EXPECT_EQ(describe(readObj("v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\r")),
            "1 of 50%");
  EXPECT_EQ(describe(readObj(std::string("\xff\xfev\0 \0", 6))),
            "it is a text in UTF-16: save it as UTF-8");
}

TEST(ObjReader, Polygons) {
  const Case cases[] = {
      {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5",
       "3 of 1000%"},
      {"v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1", "2 of 400%"},
      {"v 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 2 0\nv 1 2 0\nv 0 2 0\n"
       "f 1 2 3 4 5 6",
       "4 of 400%"},
      {"v 0 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\nv 1 1 0\n"
       "v 0 1 0\nf 8 7 6 5 4 3 2 1",
       "6 of -400%"},
      // A hole, to which the outline goes and from which it comes back.
      {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\n"
       "v 3 1 0\nf 1 2 3 4 1 5 6 7 8 5",
       "8 of 1200%"}};
  for (const Case &one : cases)
    EXPECT_EQ(describe(readObj(one.content)), one.expected) << one.content;
}

/// A comb: half of its corners turn right.
TEST(ObjReader, LargePolygon) {
  constexpr int teeth = 2000;
  std::string text = "v 0 -1 0\nv " + std::to_string(teeth) + " -1 0\n";
  std::string face = "f 1 2";
  for (int i = 0; i < teeth; ++i) {
    std::string x = std::to_string(teeth - i);
    text += "v " + x + " 0 0\nv " + std::to_string(teeth - i - 1) + ".5 1 0\n";
    face += " " + std::to_string(2 * i + 3) + " " + std::to_string(2 * i + 4);
  }
  text += "v 0 0 0\n" + face + " " + std::to_string(2 * teeth + 3);
  // A square of 1 and a tooth of a half each.
  EXPECT_EQ(describe(readObj(text)), std::to_string(2 * teeth + 1) + " of " +
                                         std::to_string(teeth * 150) + "%");
}

std::string ply(const std::string &elements, const std::string &data,
                const std::string &format = "ascii") {
  return "ply\nformat " + format +
         " 1.0\ncomment x\nelement vertex 4\nproperty float x\n"
         "property float32 y\nproperty double z\n" +
         elements + "end_header\n" +
         (format == "ascii" ? "0 0 0\n1 0 0\n0 1 0\n1 1 0\n" : "") + data;
}

const std::string faceList = "property list uchar int vertex_indices\n";
const std::string stripList = "property list int int vertex_index\n";

TEST(PlyReader, FacesAndStrips) {
  std::string faces = "element face 2\n" + faceList;
  std::string strips = "element tristrips 1\n" + stripList;
  auto read = [](const std::string &text) { return describe(readPly(text)); };
  EXPECT_EQ(read(ply(faces, "4 0 1 3 2\n3 0 1 2")), "3 of 150%");
  EXPECT_EQ(read(ply(faces, "0\n3 0 1 2")), "1 of 50%");
  EXPECT_EQ(read(ply(faces, "1 0\n2 0 1")), "it holds no triangles");
  EXPECT_EQ(read(ply(strips, "4 0 1 2 3")), "2 of 100%");
  EXPECT_EQ(read(ply(strips, "8 0 1 2 3 -1 0 1 2")), "3 of 150%");
  EXPECT_EQ(read(ply(strips, "7 0 1 2 -1 2 1 3")), "2 of 100%");
  EXPECT_EQ(read(ply(faces, "3 0 1 2\n3 0 1 4")),
            "element 'face' 1 names vertex 4 of 4");
  EXPECT_EQ(read(ply(faces, "3 0 1 2\n3 0 1 -1")),
            "element 'face' 1 names vertex -1 of 4");
  EXPECT_EQ(read(ply(faces, "3 0 1 2\n-3 0 1 2")),
            "expected the length of a list, but got -3, at 'face' 1");
  EXPECT_EQ(read(ply(faces, "3 0 1 2\n3 0 1")), "it is cut short, at 'face' 1");
  EXPECT_EQ(read(ply(faces, "3 0 1 2\n3 0 1 2\n7 7")),
            "2 of 100%; 2 bytes after its last element are ignored");
  EXPECT_EQ(read(ply("element face 4000000000\n" + faceList, "3 0 1 2")),
            "it is cut short: it has no room for 4000000000 of its element "
            "'face'");
  EXPECT_EQ(read(ply("element edge 1\nproperty int a\n"
                     "property list uchar float b\n" +
                         faces,
                     "7 2 0.5 1e9\n3 0 1 2\n3 3 2 1")),
            "2 of 100%");
}

/// Appends a number with its largest or its smallest byte first.
template <class T> void append(std::string &to, T value, bool isBigEndian) {
  std::string bytes(reinterpret_cast<const char *>(&value), sizeof value);
  if (isBigEndian == (std::endian::native == std::endian::little))
    std::ranges::reverse(bytes);
  to += bytes;
}

TEST(PlyReader, BothOrdersOfBytes) {
  for (bool isBigEndian : {false, true}) {
    std::string data;
    for (float corner : {0.f, 1.f, 2.f, 3.f}) {
      append(data, corner == 1 || corner == 3 ? 1.f : 0.f, isBigEndian);
      append(data, corner >= 2 ? 1.f : 0.f, isBigEndian);
      append(data, 0.0, isBigEndian);
    }
    for (int number : {4, 0, 1, 3, 2})
      if (number == 4)
        append(data, uint8_t(number), isBigEndian);
      else
        append(data, number, isBigEndian);
    std::string file =
        ply("element face 1\n" + faceList, data,
            isBigEndian ? "binary_big_endian" : "binary_little_endian");
    EXPECT_EQ(describe(readPly(file)), "2 of 100%");
    EXPECT_EQ(describe(readPly(file.substr(0, file.size() - 1))),
              "it is cut short, at 'face' 0");
  }
}

/// The first byte of the data may be one that ends lines.
TEST(PlyReader, DataBeginsBehindTheHeader) {
  for (const char *lineEnd : {"\n", "\r\n", "\r"})
    for (char first : {'\n', '\r', ' '}) {
      std::string text;
      for (const char *line :
           {"ply", "format binary_little_endian 1.0", "element vertex 3",
            "property uchar x", "property uchar y", "property uchar z",
            "element face 1", "property list uchar uchar vertex_indices",
            "end_header"})
        text += std::string(line) + lineEnd;
      text += first;
      text += std::string("\0\0\0\0\0\0\1\0", 8) + std::string("\3\1\0\2", 4);
      EXPECT_EQ(describe(readPly(text)),
                "1 of " + std::to_string(first * 50) + "%");
      EXPECT_EQ(describe(readPly(text.substr(0, text.size() - 1))),
                "it is cut short, at 'face' 0");
    }
}

TEST(StlReader, TextAndBinary) {
  std::string facet = "FACET normal 0 0 0\nouter loop\nvertex 0 0 0\n"
                      "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  auto read = [](const std::string &text) { return describe(readStl(text)); };
  EXPECT_EQ(read("solid facet vertex\n" + facet + "endsolid\nsolid b\n" +
                 facet + "endsolid b"),
            "2 of 100%");
  EXPECT_EQ(read("solid\n" + facet), "1 of 50%; it ends without 'endsolid'");
  EXPECT_EQ(read("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x"),
            "line 4: expected a number, but got 'x'");
  std::string binary = "solid" + std::string(75, '\n');
  binary += std::string("\1\0\0\0", 4) + std::string(12, '\0');
  for (float value : {0.f, 0.f, 0.f, 2.f, 0.f, 0.f, 0.f, 1.f, 0.f})
    binary.append(reinterpret_cast<const char *>(&value), 4);
  binary += std::string(2, '\0');
  EXPECT_EQ(read(binary), "1 of 100%");
  EXPECT_EQ(read(binary + "xy"),
            "1 of 100%; 2 bytes after its last triangle are ignored");
  EXPECT_EQ(read(binary.substr(0, 130)),
            "it is cut short: it has room for 0 of its 1 triangles");
}

} // namespace
