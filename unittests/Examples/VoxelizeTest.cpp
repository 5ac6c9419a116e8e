//===- VoxelizeTest.cpp - The voxelizer under the reference executor ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "voxelize/voxelize.piko.cpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace {

using namespace voxelize;

struct VoxelizeTest : testing::Test {
  static constexpr glm::ivec3 extent{10, 7, 5};
  std::vector<Triangle> triangles;
  Voxelizer pipe;

  void run() {
    pipe.setDomain(extent);
    pipe.feed(pipe.voxelize, triangles);
    pipe.run();
  }
  void addRandom(int count) {
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> coordinate(-2, 12);
    for (int i = 0; i < count; ++i) {
      Triangle &t = triangles.emplace_back();
      for (glm::vec3 &corner : t.corner)
        corner = {coordinate(generator), coordinate(generator),
                  coordinate(generator)};
      t.material = i;
    }
  }
};

TEST_F(VoxelizeTest, EqualsALoopOverAllVoxels) {
  addRandom(20);
  run();
  for (int z = 0; z < extent.z; ++z)
    for (int y = 0; y < extent.y; ++y)
      for (int x = 0; x < extent.x; ++x) {
        Voxel expected;
        for (const Triangle &t : triangles)
          if (touches(t, {x, y, z})) {
            ++expected.triangles;
            expected.material = t.material;
          }
        Voxel voxel = pipe.state().voxels({x, y, z});
        EXPECT_EQ(voxel.triangles, expected.triangles);
        EXPECT_EQ(voxel.material, expected.material);
      }
}

TEST_F(VoxelizeTest, OccupiesWhereverATriangleHasPoints) {
  addRandom(20);
  run();
  for (const Triangle &t : triangles)
    for (int i = 0; i <= 40; ++i)
      for (int j = 0; i + j <= 40; ++j) {
        float a = float(i) / 40, b = float(j) / 40;
        glm::vec3 point =
            a * t.corner[0] + b * t.corner[1] + (1 - a - b) * t.corner[2];
        glm::ivec3 voxel(glm::floor(point));
        bool isInside = glm::all(glm::greaterThanEqual(voxel, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(voxel, extent));
        EXPECT_TRUE(!isInside || pipe.state().voxels(voxel).triangles > 0);
      }
}

TEST_F(VoxelizeTest, LeavesOutWhatOnlyTheBoundingBoxTouches) {
  triangles = {
      {{{0.5f, 0.5f, 2.5f}, {8.5f, 0.5f, 2.5f}, {0.5f, 6.5f, 2.5f}}, 3}};
  run();
  EXPECT_EQ(pipe.state().voxels({1, 1, 2}).material, 3);
  EXPECT_EQ(pipe.state().voxels({8, 6, 2}).triangles, 0);
  EXPECT_EQ(pipe.state().voxels({1, 1, 3}).triangles, 0);
}

} // namespace
