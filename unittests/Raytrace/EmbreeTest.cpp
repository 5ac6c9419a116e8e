//===- EmbreeTest.cpp - Hits next to Embree's -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Embree meets the same triangle, except for rays that run so near to an edge
// that rounding decides which of the edge's two triangles it is.
//
//===----------------------------------------------------------------------===//
#include "Meshes.h"
#include "bvh.h"

#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <memory>
#include <type_traits>

using namespace piko::render;
using namespace raytrace;

namespace {

template <class T, void (*Release)(T *)>
using Handle =
    std::unique_ptr<T, std::integral_constant<void (*)(T *), Release>>;

/// A mesh in Embree, which tests its triangles watertightly.
class EmbreeScene {
public:
  explicit EmbreeScene(const Mesh &mesh)
      : device(rtcNewDevice(nullptr)), scene(rtcNewScene(device.get())) {
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    Handle<RTCGeometryTy, rtcReleaseGeometry> geometry(
        rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    auto *vertices = static_cast<glm::vec3 *>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
        sizeof(glm::vec3), mesh.vertices.size()));
    for (const auto &v : mesh.vertices)
      *vertices++ = v.position;
    auto *triangles = static_cast<glm::ivec3 *>(rtcSetNewGeometryBuffer(
        geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
        sizeof(glm::ivec3), mesh.triangles.size()));
    for (const auto &t : mesh.triangles)
      *triangles++ = t.vertex;
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene.get(), geometry.get());
    rtcCommitScene(scene.get());
  }

  Hit hit(glm::vec3 origin, glm::vec3 direction) const {
    RTCRayHit ray{{origin.x, origin.y, origin.z, 0, direction.x, direction.y,
                   direction.z, 0, INFINITY, ~0u, 0, 0},
                  {}};
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene.get(), &context, &ray);
    Hit hit;
    hit.t = ray.ray.tfar;
    if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID)
      hit.triangle = int32_t(ray.hit.primID);
    return hit;
  }

private:
  Handle<RTCDeviceTy, rtcReleaseDevice> device;
  Handle<RTCSceneTy, rtcReleaseScene> scene;
};

int sharedCorners(const Mesh &mesh, int32_t a, int32_t b) {
  int count = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      count += mesh.triangles[a].vertex[i] == mesh.triangles[b].vertex[k];
  return count;
}

/// How far from the triangle's nearest edge it is met, relative to the distance
/// of the hit.
double edgeDistance(const Mesh &mesh, int32_t triangle, glm::dvec3 origin,
                    glm::dvec3 direction, double t) {
  glm::dvec3 hit = origin + t * direction;
  double nearest = INFINITY;
  for (int i = 0; i < 3; ++i) {
    glm::ivec3 corners = mesh.triangles[triangle].vertex;
    glm::dvec3 a = mesh.vertices[corners[i]].position;
    glm::dvec3 b = mesh.vertices[corners[(i + 1) % 3]].position;
    double s = glm::dot(hit - a, b - a) / glm::dot(b - a, b - a);
    nearest = std::min(nearest, glm::distance(hit, a + s * (b - a)));
  }
  return nearest / glm::distance(hit, origin);
}

TEST(Embree, MeetsTheSameTriangles) {
  Mesh mesh = makePotato(180, {0.1f, -0.2f, -4});
  Bvh tree = *buildBvh(mesh);
  piko::Buffer<BvhNode> nodes;
  piko::Buffer<BvhTriangle> triangles;
  nodes.bind(tree.nodes.data(), int64_t(tree.nodes.size()));
  triangles.bind(tree.triangles.data(), int64_t(tree.triangles.size()));
  EmbreeScene embree(mesh);
  constexpr int side = 600;
  int hits = 0, others = 0;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      glm::vec3 direction(float(x) / side - 0.5f, float(y) / side - 0.5f, -1);
      Hit ours = findHit(
          {0, 0, 0}, direction, INFINITY, /*anyHit=*/false, tree.bounds, nodes,
          triangles, [](bool b) { return b; }, [](float t) { return t; });
      Hit theirs = embree.hit({0, 0, 0}, direction);
      ASSERT_EQ(ours.triangle < 0, theirs.triangle < 0);
      if (ours.triangle < 0)
        continue;
      ++hits;
      EXPECT_NEAR(ours.t / theirs.t, 1, 1e-5);
      if (ours.triangle == theirs.triangle)
        continue;
      ++others;
      EXPECT_EQ(sharedCorners(mesh, ours.triangle, theirs.triangle), 2);
      EXPECT_LT(edgeDistance(mesh, ours.triangle, {0, 0, 0}, direction, ours.t),
                1e-6);
    }
  EXPECT_GT(hits, 50000);
  EXPECT_LT(others, 50);
}

} // namespace
