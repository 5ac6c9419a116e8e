//===- MeshBuilder.cpp - Gathers the triangles of a file ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "MeshBuilder.h"

#include "Piko/Support/OutOfMemory.h"
#include "Vectors.h"

#include <algorithm>
#include <bit>
#include <limits>

#include <glm/geometric.hpp>

using namespace piko;
using namespace piko::render;

namespace {

VertexKey makeVertexKey(glm::vec3 position, glm::vec3 normal) {
  VertexKey key;
  for (int i = 0; i < 3; ++i) {
    key[i] = std::bit_cast<uint32_t>(position[i] + 0.0f); // -0 is 0
    key[i + 3] = std::bit_cast<uint32_t>(normal[i] + 0.0f);
  }
  return key;
}

} // namespace

size_t HashVertexKey::operator()(const VertexKey &key) const {
  uint64_t hash = 0x9e3779b97f4a7c15;
  for (uint32_t word : key) {
    hash = (hash ^ word) * 0xff51afd7ed558ccd;
    hash ^= hash >> 32;
  }
  return hash;
}

glm::vec3 render::normalizeOr(glm::vec3 v, glm::vec3 otherwise) {
  float length = std::sqrt(glm::dot(v, v));
  return length > 0 && std::isfinite(length) ? v * (1 / length) : otherwise;
}

template <class T> bool MeshBuilder::hasRoom(const std::vector<T> &elements) {
  if (elements.size() < elements.capacity())
    return true;
  static const uint64_t memory = support::memoryOfMachine();
  bool fits = elements.size() < memory / (2 * sizeof(T));
  if (!fits)
    fail("it takes more than the machine's memory of " +
         std::to_string(memory) + " bytes");
  return fits;
}

int32_t MeshBuilder::addVertex(glm::vec3 position, glm::vec3 normal,
                               bool toJoin) {
  if (!isFinite(position))
    fail("the position of a vertex is not finite");
  size_t next = mesh.vertices.size();
  if (next == std::numeric_limits<int32_t>::max()) {
    fail("it holds more than 2^31 vertices");
    return 0;
  }
  if (toJoin) {
    auto [known, isNew] =
        joined.try_emplace(makeVertexKey(position, normal), int32_t(next));
    if (!isNew)
      return known->second;
  }
  if (!hasRoom(mesh.vertices))
    return 0;
  mesh.vertices.push_back({position, normal, int32_t(next)});
  return int32_t(next);
}

void MeshBuilder::addTriangle(glm::ivec3 corners) {
  size_t next = mesh.triangles.size();
  if (next == std::numeric_limits<int32_t>::max())
    return fail("it holds more than 2^31 triangles");
  if (hasRoom(mesh.triangles))
    mesh.triangles.push_back({corners, int32_t(next)});
}

void MeshBuilder::addPolygon(std::span<const int32_t> corners) {
  if (corners.size() < 3 || hasFailed())
    return;
  if (corners.size() == 3)
    return addTriangle({corners[0], corners[1], corners[2]});
  outline.clear();
  split.clear();
  for (int32_t corner : corners)
    outline.push_back(mesh.vertices[corner].position);
  if (!splitPolygon(outline, split, steps))
    return fail("its polygons, one of " + std::to_string(corners.size()) +
                " corners, take too long to split into triangles");
  for (glm::ivec3 t : split)
    addTriangle({corners[t.x], corners[t.y], corners[t.z]});
}

void MeshBuilder::warn(const std::string &message) {
  if (std::ranges::count(mesh.warnings, message) == 0)
    mesh.warnings.push_back(message);
}

void MeshBuilder::fail(const std::string &message) {
  if (problem.empty())
    problem = message;
}

Result<Mesh> MeshBuilder::finish() {
  if (problem.empty() && mesh.triangles.empty())
    problem = "it holds no triangles";
  if (!problem.empty())
    return Error{problem};
  smoothNormals();
  return std::move(mesh);
}

/// Gives vertices without a normal the area-weighted mean of those of the
/// triangles around them.
void MeshBuilder::smoothNormals() {
  std::vector<char> isMissing(mesh.vertices.size());
  for (const scene::Vertex &v : mesh.vertices)
    isMissing[v.index] = v.normal == glm::vec3(0);
  for (const scene::Triangle &t : mesh.triangles) {
    glm::vec3 a = mesh.vertices[t.vertex.x].position;
    glm::vec3 b = mesh.vertices[t.vertex.y].position;
    glm::vec3 c = mesh.vertices[t.vertex.z].position;
    glm::vec3 n = glm::cross(b - a, c - a); // as long as twice the area
    for (int k = 0; k < 3; ++k)
      if (isMissing[t.vertex[k]])
        mesh.vertices[t.vertex[k]].normal += n;
  }
  for (scene::Vertex &v : mesh.vertices)
    if (isMissing[v.index])
      v.normal = normalizeOr(v.normal, {0, 0, 1});
}
