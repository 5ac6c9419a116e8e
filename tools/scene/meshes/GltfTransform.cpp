//===- GltfTransform.cpp - Where a glTF file puts its meshes --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "GltfTransform.h"

#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

using namespace piko;
using namespace piko::render;

namespace {

/// \param q a quaternion, x, y, z, w
glm::dmat3 toMatrix(const double *q) {
  double x = q[0], y = q[1], z = q[2], w = q[3];
  double length = std::sqrt(x * x + y * y + z * z + w * w);
  if (!(length > 0) || !std::isfinite(length))
    return glm::dmat3(1);
  x /= length, y /= length, z /= length, w /= length;
  glm::dmat3 m(1);
  m[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)};
  m[1] = {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)};
  m[2] = {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)};
  return m;
}

Transform compose(const double *move, const double *turn, const double *scale) {
  Transform result{toMatrix(turn), {move[0], move[1], move[2]}};
  for (int k = 0; k < 3; ++k)
    result.linear[k] *= scale[k];
  return result;
}

} // namespace

glm::vec3 Transform::apply(glm::dvec3 point) const {
  glm::dvec3 moved = linear * point + move;
  glm::vec3 result;
  for (int k = 0; k < 3; ++k) {
    // The conversion of what no float holds is not defined.
    bool fits = std::abs(moved[k]) <= std::numeric_limits<float>::max();
    result[k] = fits ? float(moved[k]) : std::numeric_limits<float>::infinity();
  }
  return result;
}

bool Transform::isMirrored() const { return glm::determinant(linear) < 0; }

glm::dmat3 Transform::normalToWorld() const {
  glm::dmat3 m(glm::cross(linear[1], linear[2]),
               glm::cross(linear[2], linear[0]),
               glm::cross(linear[0], linear[1]));
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest = std::max(longest, glm::dot(m[k], m[k]));
  if (!(longest > 0) || !std::isfinite(longest))
    return glm::dmat3(1);
  return m * ((isMirrored() ? -1 : 1) / std::sqrt(longest));
}

Transform render::readTransform(GltfFile &file, const GltfFile::Json &node) {
  if (node.contains("matrix")) {
    double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    file.numbers(node, "matrix", m, 16);
    Transform result;
    for (int k = 0; k < 3; ++k)
      result.linear[k] = {m[k * 4], m[k * 4 + 1], m[k * 4 + 2]};
    result.move = {m[12], m[13], m[14]};
    return result;
  }
  double move[3] = {0, 0, 0}, turn[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
  file.numbers(node, "translation", move, 3);
  file.numbers(node, "rotation", turn, 4);
  file.numbers(node, "scale", scale, 3);
  return compose(move, turn, scale);
}

std::vector<Transform> render::readInstances(GltfFile &file,
                                             const GltfFile::Json &instancing) {
  auto attributes = instancing.find("attributes");
  if (attributes == instancing.end() || !attributes->is_object()) {
    file.fail("EXT_mesh_gpu_instancing has no attributes");
    return {};
  }
  constexpr const char *names[] = {"TRANSLATION", "ROTATION", "SCALE"};
  std::vector<float> values[3];
  size_t count = 0;
  for (int i = 0; i < 3; ++i) {
    uint64_t accessor = 0;
    unsigned components = i == 1 ? 4 : 3;
    if (!file.index(*attributes, names[i], accessor))
      continue;
    values[i] = file.readFloats(accessor, components);
    size_t own = values[i].size() / components;
    if (file.problem.empty() && count != 0 && own != count)
      file.fail("EXT_mesh_gpu_instancing: expected " + std::to_string(count) +
                " of each attribute, but got " + std::to_string(own));
    count = own;
  }
  if (!file.problem.empty())
    return {};
  if (count == 0)
    file.fail("EXT_mesh_gpu_instancing has no translation, rotation or scale");
  std::vector<Transform> result;
  for (size_t i = 0; i < count; ++i) {
    double all[3][4] = {{0, 0, 0, 0}, {0, 0, 0, 1}, {1, 1, 1, 0}};
    for (int k = 0; k < 3; ++k)
      for (size_t c = 0; c < (k == 1 ? 4u : 3u) && !values[k].empty(); ++c)
        all[k][c] = double(values[k][i * (k == 1 ? 4 : 3) + c]);
    result.push_back(compose(all[0], all[1], all[2]));
  }
  return result;
}
