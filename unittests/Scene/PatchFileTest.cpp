//===- PatchFileTest.cpp - Patches from .bpt files, and broken ones -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "Piko/Scene/SceneFile.h"
#include "Piko/Scene/View.h"

#include <sstream>

using namespace piko::render;

namespace {

class PatchFile : public TemporaryFolder {
protected:
  /// A file of patches whose point k of patch n is (k, n, 0.5), with one line
  /// changed, counted from 1.
  static std::string makeText(int patches, int line = 0,
                              const std::string &change = "") {
    std::ostringstream text;
    text << patches << "\n";
    for (int n = 0; n < patches; ++n) {
      text << "3 3\n";
      for (int k = 0; k < 16; ++k)
        text << k << " " << n << "\t0.5\r\n";
    }
    std::istringstream lines(text.str());
    std::string result, next;
    for (int i = 1; std::getline(lines, next); ++i)
      result += (i == line ? change : next) + "\n";
    return result;
  }
  /// What is wrong, after the file's name.
  std::string errorOf(const std::string &text) {
    std::string path = write("scene.bpt", text);
    auto mesh = loadMesh(path);
    if (mesh)
      return "no error";
    std::string prefix = "cannot load scene '" + path + "': ";
    std::string message = mesh.error().message;
    EXPECT_TRUE(message.starts_with(prefix)) << message;
    return message.substr(prefix.size());
  }
};

TEST_F(PatchFile, PointsAreAlongVFirst) {
  auto mesh = loadMesh(write("scene.bpt", makeText(2)));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_TRUE(mesh->vertices.empty() && mesh->triangles.empty());
  ASSERT_EQ(mesh->patches.size(), 2u);
  for (int n = 0; n < 2; ++n) {
    EXPECT_EQ(mesh->patches[n].index, n);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        EXPECT_EQ(mesh->patches[n].points[4 * i + j],
                  glm::vec3(4 * i + j, n, 0.5f));
  }
  Sphere sphere = boundingSphere(*mesh);
  EXPECT_EQ(sphere.center, glm::vec3(7.5f, 0.5f, 0.5f));
  EXPECT_FLOAT_EQ(sphere.radius, std::hypot(7.5f, 0.5f));
}

TEST_F(PatchFile, OneWordALine) {
  std::string text = makeText(1);
  for (char &c : text)
    c = c == ' ' ? '\n' : c;
  EXPECT_EQ(errorOf(text + "\n\n"), "no error");
}

TEST_F(PatchFile, ErrorsNameTheLine) {
  EXPECT_EQ(errorOf(""), "line 1: expected the number of patches, but the file "
                         "ends");
  EXPECT_EQ(errorOf(makeText(1, 1, "many")),
            "line 1: expected the number of patches, but got 'many'");
  EXPECT_EQ(errorOf("0\n"),
            "line 1: expected from 1 to 2^31 - 1 patches, but got 0");
  EXPECT_EQ(errorOf(makeText(2, 19, "3 2")),
            "line 19: expected a bicubic patch, but got the degrees 3 and 2");
  EXPECT_EQ(errorOf(makeText(2, 19, "3 3.5")),
            "line 19: expected a degree along v, but got '3.5'");
  EXPECT_EQ(errorOf(makeText(2, 21, "1 nan 1")),
            "line 21: expected a coordinate, but got 'nan'");
  EXPECT_EQ(errorOf(makeText(2, 21, "1 2 -inf")),
            "line 21: expected a coordinate, but got '-inf'");
  EXPECT_EQ(errorOf(makeText(2, 21, "1 2 1e50")),
            "line 21: expected a coordinate, but got '1e50'");
  EXPECT_EQ(errorOf(makeText(2, 21, "1 2 3x")),
            "line 21: expected a coordinate, but got '3x'");
  // One number less: the next patch's are taken, and the last one is missing.
  EXPECT_EQ(errorOf(makeText(1, 5, "1 2")),
            "line 18: expected a coordinate, but the file ends");
  EXPECT_EQ(errorOf(makeText(1) + "4 5"),
            "line 19: expected the file to end after 1 patches, but got '4'");
}

TEST_F(PatchFile, DoesNotReserveWhatIsNotThere) {
  EXPECT_EQ(errorOf("2147483647\n3 3\n"),
            "line 2: expected a coordinate, but the file ends");
}

} // namespace
