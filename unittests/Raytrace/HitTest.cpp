//===- HitTest.cpp - What rays meet ---------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Meshes.h"
#include "bvh.h"

#include <gtest/gtest.h>

using namespace piko::render;
using namespace raytrace;

namespace {

constexpr float unlimited = INFINITY;

/// A mesh that rays are traced into: through its tree, and to compare with, at
/// each of its triangles.
class Target {
public:
  explicit Target(const Mesh &mesh) : tree(*buildBvh(mesh)) {
    nodes.bind(tree.nodes.data(), int64_t(tree.nodes.size()));
    triangles.bind(tree.triangles.data(), int64_t(tree.triangles.size()));
  }

  Hit hit(glm::vec3 origin, glm::vec3 direction, float limit = unlimited) {
    return find(origin, direction, limit, false);
  }
  bool isHit(glm::vec3 origin, glm::vec3 direction, float limit = unlimited) {
    return find(origin, direction, limit, true).triangle >= 0;
  }
  /// In the order of the tree, or backwards.
  Hit hitOfAll(glm::vec3 origin, glm::vec3 direction, bool backwards,
               float limit = unlimited) const {
    ShearedRay ray(origin, direction);
    Hit nearest;
    nearest.t = limit;
    size_t count = tree.triangles.size();
    for (size_t i = 0; i < count; ++i)
      ray.intersect(tree.triangles[backwards ? count - 1 - i : i], nearest);
    return nearest;
  }

private:
  Hit find(glm::vec3 origin, glm::vec3 direction, float limit, bool anyHit) {
    return findHit(
        origin, direction, limit, anyHit, tree.bounds, nodes, triangles,
        [](bool b) { return b; }, [](float t) { return t; });
  }

  Bvh tree;
  piko::Buffer<BvhNode> nodes;
  piko::Buffer<BvhTriangle> triangles;
};

void expectEqual(const Hit &a, const Hit &b) {
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.t, b.t);
  if (a.triangle >= 0 && b.triangle >= 0)
    EXPECT_EQ(a.weight, b.weight);
}

/// Points of triangles where rays are hard to decide: corners, points of edges,
/// and for comparison those inside.
std::vector<glm::vec3> pointsOf(const Mesh &mesh) {
  std::vector<glm::vec3> points;
  for (const auto &t : mesh.triangles) {
    glm::vec3 corner[3];
    for (int i = 0; i < 3; ++i)
      corner[i] = mesh.vertices[t.vertex[i]].position;
    for (int i = 0; i < 3; ++i) {
      glm::vec3 a = corner[i], b = corner[(i + 1) % 3];
      points.insert(points.end(), {a, a + (b - a) * 0.5f, a + (b - a) * 0.3f});
    }
    points.push_back((corner[0] + corner[1] + corner[2]) / 3.0f);
  }
  return points;
}

TEST(Hit, AccurateInsideATriangle) {
  Mesh mesh;
  addTriangle(mesh, glm::vec3(-1, -2, -3), glm::vec3(2, -1, -4),
              glm::vec3(0, 3, -5));
  Target target(mesh);
  glm::vec3 weight(0.2f, 0.3f, 0.5f), point(0);
  for (int i = 0; i < 3; ++i)
    point += weight[i] * mesh.vertices[i].position;
  for (glm::vec3 origin : {glm::vec3(0), glm::vec3(5, 7, 1),
                           glm::vec3(-9, 0.1f, 0), glm::vec3(0, -8, -30)}) {
    Hit hit = target.hit(origin, (point - origin) * 0.25f);
    ASSERT_EQ(hit.triangle, 0);
    EXPECT_NEAR(hit.t, 4, 4e-6);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(hit.weight[i], weight[i], 4e-6);
  }
}

// Along a needle t changes much, and across it hardly at all.
TEST(Hit, AccurateOnANeedle) {
  Mesh mesh;
  addTriangle(mesh, glm::vec3(-1.5f, -2, -2), glm::vec3(-1.5f, -2 + 1e-4f, -2),
              glm::vec3(1.25f, 2, -7));
  Target target(mesh);
  glm::dvec3 corner[3];
  for (int i = 0; i < 3; ++i)
    corner[i] = mesh.vertices[i].position;
  glm::dvec3 n = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
  int hits = 0;
  for (int i = 1; i < 1000; ++i) {
    double along = i / 1000.0;
    glm::vec3 direction((corner[0] + corner[1]) * (0.5 * (1 - along)) +
                        corner[2] * along);
    Hit hit = target.hit({0, 0, 0}, direction);
    if (hit.triangle < 0) // beside it, by rounding
      continue;
    ++hits;
    double t = glm::dot(corner[0], n) / glm::dot(glm::dvec3(direction), n);
    EXPECT_NEAR(hit.t, t, 1e-5);
    EXPECT_NEAR(hit.weight.z, along, 1e-5);
  }
  EXPECT_GT(hits, 900);
}

TEST(Hit, BothSidesWithinTheLimit) {
  Mesh mesh;
  addRectangle(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  Target target(mesh);
  for (float side : {-1.0f, 1.0f}) {
    glm::vec3 origin(0.25f, 0.5f, 2 * side), direction(0, 0, -side);
    EXPECT_EQ(target.hit(origin, direction).t, 2);
    EXPECT_EQ(target.hit(origin, direction, 2).triangle, -1);
    EXPECT_FALSE(target.isHit(origin, direction, 2));
    EXPECT_TRUE(target.isHit(origin, direction, 2.001f));
    EXPECT_EQ(target.hit(origin, -direction).triangle, -1);
  }
}

// Of several triangles at the same place, that with the smallest index.
TEST(Hit, TiesGoToTheSmallestIndex) {
  Mesh mesh;
  for (int i = 0; i < 40; ++i)
    addRectangle(mesh, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  Target target(mesh);
  // On the diagonal both triangles of a rectangle are met.
  for (glm::vec3 direction :
       {glm::vec3(0, 0, -1), glm::vec3(0.5f, 0.25f, -1), glm::vec3(1, 1, -1)}) {
    Hit hit = target.hit({0, 0, 0}, direction);
    EXPECT_EQ(hit.triangle, 0);
    EXPECT_EQ(hit.t, 1);
  }
  EXPECT_EQ(target.hit({0, 0, 0}, {-0.25f, 0.5f, -1}).triangle, 1);
}

// From inside of a closed mesh each ray meets it: through corners and edges,
// and along axes in the very planes of corners and boxes.
TEST(Hit, NoLeakInACube) {
  Mesh mesh = makeCube(8);
  Target target(mesh);
  const float inside[] = {-0.875f, -0.5f, 0, 0.25f, 0.3f};
  std::vector<glm::vec3> points = pointsOf(mesh);
  for (float x : inside)
    for (float y : inside)
      for (float z : inside) {
        glm::vec3 origin(x, y, z);
        for (int axis = 0; axis < 3; ++axis)
          for (float sign : {-1.0f, 1.0f})
            for (float other : {0.0f, -0.0f}) {
              glm::vec3 direction(other);
              direction[axis] = sign;
              EXPECT_EQ(target.hit(origin, direction).t,
                        1 - sign * origin[axis]);
            }
        for (glm::vec3 point : points) {
          Hit hit = target.hit(origin, point - origin);
          EXPECT_NEAR(hit.t, 1, 1e-6);
          EXPECT_TRUE(target.isHit(origin, point - origin));
        }
      }
}

TEST(Hit, NoLeakInAPotato) {
  for (glm::vec3 center : {glm::vec3(0), glm::vec3(1000, -300, 20)}) {
    Mesh mesh = makePotato(24, center);
    Target target(mesh);
    for (glm::vec3 origin : {glm::vec3(0), glm::vec3(0.3f, 0.1f, -0.2f)})
      for (glm::vec3 point : pointsOf(mesh))
        EXPECT_TRUE(target.isHit(center + origin, point - (center + origin)));
  }
}

// The box of a triangle lets all rays through that meet the triangle, also
// those at its edges where these are the box's, from afar and from close by,
// where the triangle reaches after the origin.
TEST(Hit, BoxesLetHitsThrough) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> d(-1, 1);
  auto anywhere = [&] { return glm::vec3(d(random), d(random), d(random)); };
  int hits = 0;
  for (int i = 0; i < 500000; ++i) {
    float far = std::exp2(5 + 5 * d(random));
    glm::vec3 place = far * anywhere(), corner[3];
    for (glm::vec3 &c : corner)
      c = place + anywhere();
    int k = i % 3;
    for (glm::vec3 &c : corner)
      c[k] = corner[0][k];
    corner[1][(k + 1) % 3] = corner[0][(k + 1) % 3];
    corner[2][(k + 2) % 3] = corner[0][(k + 2) % 3];
    BvhTriangle triangle{};
    BvhNode node{};
    piko::scene::Bounds box{
        glm::min(corner[0], glm::min(corner[1], corner[2])),
        glm::max(corner[0], glm::max(corner[1], corner[2]))};
    for (int axis = 0; axis < 3; ++axis) {
      node.bounds[axis][0] = box.lo[axis];
      node.bounds[axis + 3][0] = box.hi[axis];
      for (int j = 0; j < 3; ++j)
        triangle.corner[j][axis] = corner[j][axis];
    }
    glm::vec3 onEdge =
        corner[0] + (corner[1] - corner[0]) * (0.5f + 0.5f * d(random));
    glm::vec3 origin =
        i % 8 == 0   ? glm::vec3(0)
        : i % 8 == 1 ? far * anywhere()
                     : onEdge + anywhere() * std::exp2(-10 - 10 * d(random));
    Hit hit;
    hit.t = unlimited;
    if (!ShearedRay(origin, onEdge - origin).intersect(triangle, hit))
      continue;
    ++hits;
    EXPECT_LT(
        SlabRay(origin, onEdge - origin, box).enter(node, 0, hit.t * longer),
        INFINITY);
  }
  EXPECT_GT(hits, 100000);
}

// Neither the tree nor the order of triangles changes a bit, even if a ray runs
// through corners, along edges, or within the plane of a triangle; near the
// mesh, or so far away that rounding is coarse.
TEST(Hit, DoesNotDependOnTheTree) {
  int hits = 0;
  for (glm::vec3 place : {glm::vec3(0), glm::vec3(3000, -500, 2000)})
    for (Mesh mesh : {makeSoup(600, 1), makePotato(12, {0.1f, 0.2f, 0}),
                      makeCube(8), makeConfetti(400)}) {
      for (auto &v : mesh.vertices)
        v.position += place;
      Target scene(mesh);
      std::vector<glm::vec3> points = pointsOf(mesh);
      std::mt19937 random(5);
      std::uniform_real_distribution<float> d(-10, 10);
      std::uniform_int_distribution<size_t> any(0, points.size() - 1);
      for (int i = 0; i < 6000; ++i) {
        glm::vec3 target = points[any(random)];
        glm::vec3 origin(d(random), d(random), d(random));
        int axis = i / 6 % 3;
        if (i % 6 == 1)
          origin += place;
        if (i % 6 == 2)
          origin += 1000.0f * origin;
        if (i % 6 == 3)
          origin = points[any(random)];
        if (i % 6 == 4)
          origin[axis] = points[any(random)][axis];
        glm::vec3 direction = target - origin;
        if (i % 6 == 5)
          direction[axis] = 0;
        if (glm::dot(direction, direction) == 0)
          continue;
        Hit hit = scene.hit(origin, direction);
        expectEqual(hit, scene.hitOfAll(origin, direction, false));
        expectEqual(hit, scene.hitOfAll(origin, direction, true));
        EXPECT_EQ(hit.triangle >= 0, scene.isHit(origin, direction));
        hits += hit.triangle >= 0;
      }
    }
  EXPECT_GT(hits, 20000);
}

// Rays whose component is exactly 0, of either sign, that start in the plane of
// a side of boxes, in a room and outside of it, some along an axis.
TEST(Hit, RaysInThePlanesOfBoxes) {
  Mesh mesh = makeCube(8);
  Target room(mesh);
  int hits = 0, misses = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int plane = -9; plane <= 9; ++plane)
      for (int i = 0; i < 1000; ++i) {
        int u = (axis + 1) % 3, v = (axis + 2) % 3;
        glm::vec3 origin, direction;
        origin[axis] = float(plane) / 8;
        origin[u] = float(i % 10 - 5) / 4;
        origin[v] = float(i / 10 % 10 - 5) / (i % 2 ? 4.0f : 3.0f);
        direction[axis] = i % 4 < 2 ? 0.0f : -0.0f;
        direction[u] = float(i / 100 % 3 - 1);
        direction[v] = float(i / 300 % 3 - 1) * (i % 3 ? 1.0f : 0.37f);
        if (direction[u] == 0 && direction[v] == 0)
          continue;
        Hit hit = room.hit(origin, direction);
        expectEqual(hit, room.hitOfAll(origin, direction, false));
        EXPECT_EQ(hit.triangle >= 0, room.isHit(origin, direction));
        ++(hit.triangle >= 0 ? hits : misses);
      }
  EXPECT_GT(hits, 10000);
  EXPECT_GT(misses, 10000);
}

TEST(Hit, DegenerateTrianglesAreNotMet) {
  Mesh mesh;
  int a = addVertex(mesh, {-1, -1, -2}), b = addVertex(mesh, {1, 1, -2});
  addTriangle(mesh, a, a, a);
  addTriangle(mesh, a, b, b);
  addTriangle(mesh, a, b, addVertex(mesh, {0, 0, -2}));
  Target target(mesh);
  for (glm::vec3 direction : {glm::vec3(-1, -1, -2), glm::vec3(0, 0, -2),
                              glm::vec3(0.5f, 0.5f, -2), glm::vec3(1, 1, 1)})
    EXPECT_FALSE(target.isHit({0, 0, 0}, direction));
}

// A triangle that is seen from the side hides nothing.
TEST(Hit, EdgeOnTrianglesAreNotMet) {
  Mesh mesh;
  addRectangle(mesh, {0, 0, -2}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0});
  addRectangle(mesh, {0, 0, -4}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  Hit hit = Target(mesh).hit({0.25f, 0, 0}, {0, 0, -1});
  EXPECT_EQ(hit.t, 4);
  EXPECT_GE(hit.triangle, 2);
}

TEST(Hit, NoneWithoutTriangles) {
  Target target({});
  EXPECT_FALSE(target.isHit({0, 0, 0}, {0, 0, -1}));
  EXPECT_EQ(target.hit({0, 0, 0}, {0, 0, -1}).triangle, -1);
}

TEST(Hit, NoneForNumbersThatAreNone) {
  Target target(makeCube(2));
  const float nan = std::nanf("");
  for (glm::vec3 direction :
       {glm::vec3(0), glm::vec3(nan, 0, 1), glm::vec3(0, INFINITY, 0),
        glm::vec3(1e-30f), glm::vec3(1e30f)})
    EXPECT_FALSE(target.isHit({0, 0, 0}, direction));
  for (glm::vec3 origin :
       {glm::vec3(nan, 0, 0), glm::vec3(0, -INFINITY, 0), glm::vec3(1e30f)})
    EXPECT_FALSE(target.isHit(origin, {0, 1, 0}));
}

// Triangles with a corner that is NaN or infinite are as if they were not.
TEST(Hit, TrianglesWithoutAPlaceAreNotMet) {
  Mesh mesh = makePotato(8, {0, 0, 0});
  Target before(mesh);
  for (float bad : {std::nanf(""), INFINITY, -INFINITY})
    for (int axis = 0; axis < 3; ++axis) {
      glm::vec3 position(0.5f);
      position[axis] = bad;
      addTriangle(mesh, 0, 1, addVertex(mesh, position));
    }
  Target after(mesh);
  for (glm::vec3 point : pointsOf(makePotato(5, {0, 0, 0})))
    expectEqual(before.hit({0.1f, 0, 0}, point),
                after.hit({0.1f, 0, 0}, point));
}

} // namespace
