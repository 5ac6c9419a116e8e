//===- MeshBuilder.h - Gathers the triangles of a file ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_MESHBUILDER_H
#define PIKO_TOOLS_SCENE_MESHBUILDER_H

#include "Piko/Scene/SceneFile.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace piko::render {

/// Position and normal, bit by bit. Vertices without a normal have none of
/// unit length, so they join no vertex that has one.
using VertexKey = std::array<uint32_t, 6>;

struct HashVertexKey {
  size_t operator()(const VertexKey &key) const;
};

/// Gathers vertices and polygons. What goes wrong first is kept, and `finish`
/// returns it.
class MeshBuilder {
public:
  /// Adds a vertex; a normal of 0 is one that the file lacks. Joins it with an
  /// equal one if it is `toJoin`. \returns its place
  int32_t addVertex(glm::vec3 position, glm::vec3 normal, bool toJoin);

  /// Adds a triangle of vertices that were added.
  void addTriangle(glm::ivec3 corners);

  /// Adds a polygon of vertices that were added, split into triangles; none if
  /// it has fewer than three corners.
  void addPolygon(std::span<const int32_t> corners);

  /// Says, once, what of a file is left out.
  void warn(const std::string &message);

  /// Keeps what is wrong with the file, unless something was before.
  void fail(const std::string &message);
  bool hasFailed() const { return !problem.empty(); }

  /// The mesh, with normals where the file had none. The error is the first
  /// that was kept, or that there are no triangles.
  Result<Mesh> finish();

private:
  void smoothNormals();
  /// Whether another one fits into the machine's memory, or a failure.
  template <class T> bool hasRoom(const std::vector<T> &elements);

  Mesh mesh;
  std::unordered_map<VertexKey, int32_t, HashVertexKey> joined;
  std::vector<glm::vec3> outline;
  std::vector<glm::ivec3> split;
  uint64_t steps = 0; ///< that splitting polygons has taken
  std::string problem;
};

/// v of unit length, or `otherwise` if it has no direction.
glm::vec3 normalizeOr(glm::vec3 v, glm::vec3 otherwise);

/// Splits the polygon with these corners, more than three, into triangles that
/// face as it does and cover it, as long as it does not cross itself: a convex
/// one by diagonals from a corner, any other ear by ear. \param steps grows by
/// the work that it took. \returns false if that was beyond a limit
bool splitPolygon(std::span<const glm::vec3> corners,
                  std::vector<glm::ivec3> &triangles, uint64_t &steps);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_MESHBUILDER_H
