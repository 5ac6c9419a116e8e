//===- View.cpp - Camera, lights and ground for a scene -------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Benchmarks compare pictures with those of other renderers, which place
// camera and lights by the same formulas: keep the operations as they are.
//
//===----------------------------------------------------------------------===//
#include "Piko/Scene/View.h"
#include "DepthRange.h"
#include "meshes/Vectors.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

using namespace piko;
using namespace piko::render;

namespace {

constexpr float goldenAngle = 2.39996323f;

glm::vec3 unit(glm::vec3 v) { return v * (1 / std::sqrt(glm::dot(v, v))); }

/// Calls f with all positions of a scene.
template <class F> void forEachPoint(const Mesh &mesh, F f) {
  for (const scene::Vertex &v : mesh.vertices)
    f(v.position);
  for (const scene::Patch &patch : mesh.patches)
    for (glm::vec3 p : patch.points)
      f(p);
}

/// World to clip space. The rows of the product of projection and view are the
/// camera's axes, since its right and up already hold the angles of view.
glm::mat4 viewProjection(const scene::Camera &c) {
  glm::vec3 x = c.right * (1 / glm::dot(c.right, c.right));
  glm::vec3 y = c.up * (1 / glm::dot(c.up, c.up));
  glm::vec3 z = c.forward;
  float depth = c.farZ - c.nearZ;
  float scale = (c.farZ + c.nearZ) / depth;
  float shift = 2 * c.farZ * c.nearZ / depth;
  glm::mat4 m;
  for (int i = 0; i < 3; ++i)
    m[i] = {x[i], y[i], scale * z[i], z[i]};
  m[3] = {-glm::dot(x, c.eye), -glm::dot(y, c.eye),
          -scale * glm::dot(z, c.eye) - shift, -glm::dot(z, c.eye)};
  return m;
}

/// How much farther than the scene the far plane is, so that rounding of depths
/// does not put the scene's end beyond: the more, the nearer the near plane.
float farMargin(float nearZ, float reach) {
  float part = 5e-7f * reach / nearZ;
  return 1 + std::clamp(part, 0.001f, 0.1f);
}

std::string textOf(double distance) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", distance);
  return text;
}

/// Sets the planes of depth where options do not, and the matrix.
Result<Done> setPlanes(scene::Camera &camera, const ViewOptions &options,
                       float nearZ, float reach) {
  camera.nearZ = options.nearZ.value_or(nearZ);
  if (!(camera.nearZ > 0) || !std::isfinite(camera.nearZ))
    return Error{"expected a near plane at a distance above 0, but got " +
                 textOf(camera.nearZ)};
  camera.farZ = options.farZ.value_or(reach * farMargin(camera.nearZ, reach));
  if (!options.farZ && !(camera.farZ > camera.nearZ)) // all is before it
    camera.farZ = camera.nearZ * 2;
  if (!(camera.farZ > camera.nearZ) || !std::isfinite(camera.farZ))
    return Error{"expected a far plane beyond the near one, which is at " +
                 textOf(camera.nearZ) + ", but got " + textOf(camera.farZ)};
  if (camera.nearZ < 0.999 * leastNear * camera.farZ)
    return Error{"expected a near plane at " + textOf(leastNear) +
                 " of the far plane's distance, " + textOf(camera.farZ) +
                 ", or beyond, but got " + textOf(camera.nearZ)};
  camera.viewProjection = viewProjection(camera);
  return Done{};
}

/// How far along `forward` a scene begins and ends.
struct Extent {
  float begin, end;

  Extent(const scene::Camera &camera, const Sphere &scene) {
    float distance = glm::dot(scene.center - camera.eye, camera.forward);
    float least = 1e-3f * scene.radius;
    begin = std::max((distance - scene.radius) * 0.999f, least);
    end = std::max(distance + scene.radius, least);
  }
};

std::string describeCut(const char *plane, double at, int64_t count,
                        const char *where, double end, const char *option) {
  return std::string("the ") + plane + " plane, at a distance of " +
         textOf(at) + ", cuts off what is seen of triangles or patches, " +
         std::to_string(count) + " in number, the " + where + " at " +
         textOf(end) + "; " + option + " says where it is";
}

/// How many pixels' widths, at most, rays through the middle row and column are
/// off the pixels' centres, as floats round the rays' directions.
double findRayError(const scene::Camera &camera, int width, int height) {
  glm::dvec3 right = camera.right, up = camera.up, forward = camera.forward;
  double most = 0;
  auto trace = [&](int x, int y) {
    float across = 2 * (x + 0.5f) / width - 1,
          down = 1 - 2 * (y + 0.5f) / height;
    glm::dvec3 exact = forward + right * double(across) + up * double(down);
    glm::dvec3 error =
        glm::dvec3(camera.forward + camera.right * across + camera.up * down) -
        exact;
    most = std::max(
        {most,
         std::fabs(glm::dot(error, right) / glm::dot(right, right)) * width / 2,
         std::fabs(glm::dot(error, up) / glm::dot(up, up)) * height / 2});
  };
  for (int x = 0; x < width; ++x)
    trace(x, height / 2);
  for (int y = 0; y < height; ++y)
    trace(width / 2, y);
  return most;
}

} // namespace

Sphere render::boundingSphere(const Mesh &mesh) {
  glm::vec3 lo = mesh.patches.empty() ? mesh.vertices.at(0).position
                                      : mesh.patches[0].points[0];
  glm::vec3 hi = lo;
  forEachPoint(mesh, [&](glm::vec3 p) {
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  });
  Sphere sphere{(lo + hi) * 0.5f, 0};
  forEachPoint(mesh, [&](glm::vec3 p) {
    glm::vec3 d = p - sphere.center;
    sphere.radius = std::max(sphere.radius, std::sqrt(glm::dot(d, d)));
  });
  return sphere;
}

void render::addGround(Mesh &mesh) {
  Sphere scene = boundingSphere(mesh);
  float reach = 2 * scene.radius, height = scene.center.y;
  forEachPoint(mesh, [&](glm::vec3 p) { height = std::min(height, p.y); });
  auto at = [&](float x, float z) {
    return glm::vec3(scene.center.x + x * reach, height,
                     scene.center.z + z * reach);
  };
  if (!mesh.patches.empty()) {
    scene::Patch ground{.points = {}, .index = int32_t(mesh.patches.size())};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        ground.points[4 * i + j] =
            at(float(2 * j - 3) / 3, float(2 * i - 3) / 3);
    mesh.patches.push_back(ground);
    return;
  }
  auto first = int32_t(mesh.vertices.size());
  for (glm::vec2 corner : {glm::vec2(-1, -1), {-1, 1}, {1, 1}, {1, -1}})
    mesh.vertices.push_back(
        {at(corner.x, corner.y), {0, 1, 0}, int32_t(mesh.vertices.size())});
  for (glm::ivec3 corners : {glm::ivec3(0, 1, 2), {0, 2, 3}})
    mesh.triangles.push_back({corners + first, int32_t(mesh.triangles.size())});
}

Result<scene::Camera> render::makeCamera(const ViewOptions &options,
                                         const Sphere &scene) {
  if (!(scene.radius > 0) || !std::isfinite(scene.radius))
    return Error{"expected a scene with an extent, but all of it is one point"
                 " or beyond the range of floats"};
  if (!(options.fovy > 0 && options.fovy < 180))
    return Error{"expected a field of view between 0 and 180 degrees"};
  float aspect = float(options.width) / float(options.height);
  float tangent = std::tan(options.fovy * std::numbers::pi_v<float> / 360);
  // The narrower of the two angles holds the sphere.
  float half = std::atan(tangent * std::min(1.0f, aspect));

  scene::Camera camera;
  glm::vec3 at = options.at.value_or(scene.center);
  camera.eye =
      options.eye.value_or(at + glm::vec3(0, 0, scene.radius / std::sin(half)));
  camera.forward = unit(at - camera.eye);
  if (!isFinite(camera.forward))
    return Error{"expected a camera that looks somewhere, but its eye is where "
                 "it looks at"};
  glm::vec3 upwards = std::fabs(camera.forward.y) > 0.999f ? glm::vec3(0, 0, -1)
                                                           : glm::vec3(0, 1, 0);
  glm::vec3 right = unit(glm::cross(camera.forward, upwards));
  camera.right = right * (tangent * aspect);
  camera.up = glm::cross(right, camera.forward) * tangent;
  if (!std::isnormal(glm::dot(camera.right, camera.right)) ||
      !std::isnormal(glm::dot(camera.up, camera.up)))
    return Error{"expected a field of view that floats resolve both ways"};

  Extent extent(camera, scene);
  if (auto ok = setPlanes(camera, options, extent.begin, extent.end); !ok)
    return ok.error();
  return camera;
}

Result<scene::Camera> render::makeCamera(const ViewOptions &options,
                                         const Mesh &mesh,
                                         std::vector<std::string> &warnings) {
  Sphere scene = boundingSphere(mesh);
  auto camera = makeCamera(options, scene);
  if (!camera)
    return camera;
  CutParts cut = findCutParts(*camera, mesh);
  if (cut.beforeNear > 0 && !options.nearZ) {
    Extent extent(*camera, scene);
    double farZ = options.farZ.value_or(extent.end * 1.1f);
    auto nearZ = float(std::max(cut.nearest * 0.999, leastNear * farZ));
    if (auto ok = setPlanes(*camera, options, nearZ, extent.end); !ok)
      return ok.error();
    cut = findCutParts(*camera, mesh);
  }
  if (cut.beforeNear > 0)
    warnings.push_back(describeCut("near", camera->nearZ, cut.beforeNear,
                                   "nearest", cut.nearest, "--near"));
  if (cut.beyondFar > 0)
    warnings.push_back(describeCut("far", camera->farZ, cut.beyondFar,
                                   "farthest", cut.farthest, "--far"));
  double off = findRayError(*camera, options.width, options.height);
  if (off > 0.5)
    warnings.push_back(
        "the field of view is narrower than floats resolve where "
        "the camera looks: pixels are up to " +
        textOf(off) +
        " of their widths off; a camera that looks "
        "along an axis resolves more");
  return camera;
}

std::vector<scene::Light> render::makeLights(int count, const Sphere &scene) {
  std::vector<scene::Light> lights;
  float power = (count == 1 ? 1.0f : 3.0f) / float(count);
  for (int i = 0; i < count; ++i) {
    // From the top of a sphere downwards, turning by the golden angle.
    float z = 1 - (i + 0.5f) / count * 1.4f;
    float r = std::sqrt(std::max(0.0f, 1 - z * z));
    float angle = i * goldenAngle + 0.8f;
    glm::vec3 direction = {r * std::cos(angle), r * std::sin(angle), z};
    if (i == 0)
      direction = unit({0.4f, 0.6f, 0.7f});
    bool isPoint = i % 2 == 1;
    glm::vec3 position =
        isPoint ? scene.center + direction * (2 * scene.radius) : direction;
    auto hue = [&](float shift) {
      return power * (0.7f + 0.3f * std::cos(i * 0.7f + shift));
    };
    lights.push_back({glm::vec4(position, isPoint ? 1.0f : 0.0f),
                      glm::vec4(hue(0), hue(2), hue(4), 0)});
  }
  return lights;
}
