//===- BvhTest.cpp - Trees of boxes ---------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Bvh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace piko;
using namespace piko::render;

namespace {

Mesh makeSoup(int count, float size) {
  Mesh mesh;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> d(-1, 1);
  for (int i = 0; i < count; ++i) {
    glm::vec3 center(d(random), d(random), d(random));
    for (int k = 0; k < 3; ++k)
      mesh.vertices.push_back(
          {center + size * glm::vec3(d(random), d(random), d(random)),
           {0, 0, 1},
           3 * i + k});
    mesh.triangles.push_back({{3 * i, 3 * i + 1, 3 * i + 2}, i});
  }
  return mesh;
}

/// Walks over a tree and counts its triangles.
class Walk {
public:
  explicit Walk(const Bvh &bvh, const Mesh &mesh)
      : seen(mesh.triangles.size()), bvh(bvh), mesh(mesh) {
    const float all[] = {bvh.bounds.lo.x, bvh.bounds.lo.y, bvh.bounds.lo.z,
                         bvh.bounds.hi.x, bvh.bounds.hi.y, bvh.bounds.hi.z};
    if (!bvh.nodes.empty())
      visit(0, 1, all);
  }

  std::vector<int> seen; ///< how often each triangle of the mesh
  int depth = 0;

private:
  void visit(int32_t place, int level, const float (&outer)[6]) {
    ASSERT_LE(level, scene::bvhDepth);
    depth = std::max(depth, level);
    const scene::BvhNode &node = bvh.nodes.at(place);
    for (int i = 0; i < scene::bvhWidth; ++i) {
      float box[6];
      for (int side = 0; side < 6; ++side)
        box[side] = node.bounds[side][i];
      if (box[0] > box[3]) { // no child
        for (int side = 0; side < 6; ++side)
          EXPECT_EQ(box[side], side < 3 ? INFINITY : -INFINITY);
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        EXPECT_GE(box[k], outer[k]);
        EXPECT_LE(box[k + 3], outer[k + 3]);
      }
      if (node.count[i] == 0)
        visit(node.child[i], level + 1, box);
      for (int k = 0; k < node.count[i]; ++k)
        visitTriangle(bvh.triangles.at(node.child[i] + k), box);
      for (int k = 1; k < node.count[i]; ++k)
        EXPECT_LT(bvh.triangles[node.child[i] + k - 1].index,
                  bvh.triangles[node.child[i] + k].index);
    }
  }

  void visitTriangle(const scene::BvhTriangle &t, const float (&box)[6]) {
    ++seen.at(t.index);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        int32_t vertex = mesh.triangles[t.index].vertex[i];
        EXPECT_EQ(t.corner[i][k], mesh.vertices[vertex].position[k]);
        EXPECT_GE(t.corner[i][k], box[k]);
        EXPECT_LE(t.corner[i][k], box[k + 3]);
      }
  }

  const Bvh &bvh;
  const Mesh &mesh;
};

TEST(BvhTest, HoldsEachTriangleOnceInItsBoxes) {
  for (int count : {1, 2, 9, 100, 5000})
    for (float size : {0.0f, 0.02f, 2.0f}) {
      Mesh mesh = makeSoup(count, size);
      auto bvh = buildBvh(mesh);
      ASSERT_TRUE(bvh) << bvh.error().message;
      EXPECT_EQ(Walk(*bvh, mesh).seen, std::vector<int>(count, 1));
    }
}

TEST(BvhTest, SplitsBySurface) {
  Mesh mesh = makeSoup(5000, 0.02f);
  auto bvh = buildBvh(mesh);
  ASSERT_TRUE(bvh);
  EXPECT_LE(Walk(*bvh, mesh).depth, 8);
  EXPECT_LT(bvh->nodes.size(), 2500u);
}

TEST(BvhTest, AllTrianglesAtOnePlace) {
  Mesh mesh = makeSoup(1, 1);
  for (int i = 1; i < 3000; ++i)
    mesh.triangles.push_back({{0, 1, 2}, i});
  auto bvh = buildBvh(mesh);
  ASSERT_TRUE(bvh) << bvh.error().message;
  EXPECT_EQ(Walk(*bvh, mesh).seen, std::vector<int>(3000, 1));
}

TEST(BvhTest, EmptyMesh) {
  auto bvh = buildBvh({});
  ASSERT_TRUE(bvh);
  EXPECT_TRUE(bvh->nodes.empty());
  EXPECT_TRUE(bvh->triangles.empty());
}

TEST(BvhTest, LeavesOutTrianglesWithoutAPlace) {
  Mesh mesh = makeSoup(20, 0.1f);
  std::vector<int> expected(20, 1);
  const float bad[] = {std::nanf(""), INFINITY, -INFINITY};
  for (int i = 0; i < 9; ++i) {
    mesh.vertices[3 * (2 * i) + i % 3].position[i / 3] = bad[i % 3];
    expected[2 * i] = 0;
  }
  auto bvh = buildBvh(mesh);
  ASSERT_TRUE(bvh);
  EXPECT_EQ(Walk(*bvh, mesh).seen, expected);
  for (auto &t : mesh.triangles)
    t.vertex = {0, 0, 0};
  EXPECT_TRUE(buildBvh(mesh)->nodes.empty());
}

TEST(BvhTest, LargestAndSmallestNumbers) {
  for (float scale : {1e-40f, 1e-30f, 1e18f, 1e37f}) {
    Mesh mesh = makeSoup(500, 0.1f);
    for (auto &v : mesh.vertices)
      v.position *= scale;
    auto bvh = buildBvh(mesh);
    ASSERT_TRUE(bvh) << bvh.error().message;
    EXPECT_EQ(Walk(*bvh, mesh).seen, std::vector<int>(500, 1));
  }
}

} // namespace
