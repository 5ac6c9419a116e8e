// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- simplify.cpp - A level of detail of a mesh for a view --------------===//
//
//   simplify MESH OUT.obj PIXELS CLUSTER WIDTH HEIGHT FOVY [EYE-X Y Z]
//
// Writes a mesh whose surface is about so many pixels off, as meshoptimizer
// measures it, at the least distance of a vertex from the eye; without an eye,
// from where piko-render puts it. With clusters of so many triangles, not 0,
// each has a level for its own distance, and borders between them stay as they
// are, so that no crack opens. Degenerate triangles keep the vertices by which
// piko-render places camera and lights. Prints the triangles before and after.
//
//===----------------------------------------------------------------------===//

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

namespace {

struct Vertex {
  aiVector3D position, normal;
};

struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<unsigned> indices;
};

/// As piko-render: vertices without a normal have the area-weighted mean of the
/// triangles around them.
void addNormals(Mesh &mesh) {
  std::vector<char> isMissing;
  for (const Vertex &v : mesh.vertices)
    isMissing.push_back(v.normal == aiVector3D());
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const unsigned *corners = &mesh.indices[i];
    aiVector3D a = mesh.vertices[corners[0]].position;
    aiVector3D normal = (mesh.vertices[corners[1]].position - a) ^
                        (mesh.vertices[corners[2]].position - a);
    for (int k = 0; k < 3; ++k)
      if (isMissing[corners[k]])
        mesh.vertices[corners[k]].normal += normal;
  }
  for (Vertex &v : mesh.vertices)
    v.normal.NormalizeSafe();
}

Mesh load(const char *path) {
  Assimp::Importer importer;
  const aiScene *scene = importer.ReadFile(
      path, aiProcess_Triangulate | aiProcess_PreTransformVertices |
                aiProcess_JoinIdenticalVertices);
  Mesh mesh;
  for (unsigned m = 0; scene && m < scene->mNumMeshes; ++m) {
    const aiMesh &part = *scene->mMeshes[m];
    auto first = unsigned(mesh.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i)
      mesh.vertices.push_back({part.mVertices[i], part.HasNormals()
                                                      ? part.mNormals[i]
                                                      : aiVector3D()});
    for (unsigned f = 0; f < part.mNumFaces; ++f)
      if (part.mFaces[f].mNumIndices == 3)
        for (int k = 0; k < 3; ++k)
          mesh.indices.push_back(first + part.mFaces[f].mIndices[k]);
  }
  if (mesh.indices.empty()) {
    std::fprintf(stderr, "%s: %s\n", path, importer.GetErrorString());
    std::exit(1);
  }
  addNormals(mesh);
  return mesh;
}

/// The vertices that a bounding box and the sphere about its middle rest on.
struct Extremes {
  std::vector<unsigned> vertices;
  aiVector3D center;
  float radius;

  explicit Extremes(const std::vector<Vertex> &all) {
    auto extreme = [&](auto less) {
      auto found = std::max_element(all.begin(), all.end(), less);
      vertices.push_back(unsigned(found - all.begin()));
      return found->position;
    };
    aiVector3D lo, hi;
    for (unsigned k = 0; k < 3; ++k) {
      lo[k] = extreme([k](const Vertex &a, const Vertex &b) {
        return a.position[k] > b.position[k];
      })[k];
      hi[k] = extreme([k](const Vertex &a, const Vertex &b) {
        return a.position[k] < b.position[k];
      })[k];
    }
    center = (lo + hi) * 0.5f;
    radius = (extreme([this](const Vertex &a, const Vertex &b) {
                return (a.position - center).SquareLength() <
                       (b.position - center).SquareLength();
              }) -
              center)
                 .Length();
  }
};

struct View {
  aiVector3D eye;
  float pixel; ///< how wide a pixel is at a distance of 1

  /// How large so many pixels are at the nearest of some vertices.
  float worldSize(float pixels, const Mesh &mesh, const unsigned *indices,
                  size_t count) const {
    float nearest = INFINITY;
    for (size_t i = 0; i < count; ++i)
      nearest = std::min(nearest,
                         (mesh.vertices[indices[i]].position - eye).Length());
    return pixels * pixel * nearest;
  }
};

std::vector<unsigned> simplify(const Mesh &mesh, const View &view, float pixels,
                               size_t cluster) {
  const float *positions = &mesh.vertices[0].position.x;
  size_t vertexCount = mesh.vertices.size(), count = mesh.indices.size();
  std::vector<unsigned> sorted(count), result;
  meshopt_spatialSortTriangles(sorted.data(), mesh.indices.data(), count,
                               positions, vertexCount, sizeof(Vertex));
  float scale = meshopt_simplifyScale(positions, vertexCount, sizeof(Vertex));
  size_t step = cluster > 0 ? 3 * cluster : count;
  for (size_t first = 0; first < count; first += step) {
    const unsigned *indices = &sorted[first];
    size_t own = std::min(step, count - first);
    float error = view.worldSize(pixels, mesh, indices, own) / scale;
    std::vector<unsigned> simple(own);
    simple.resize(meshopt_simplify(
        simple.data(), indices, own, positions, vertexCount, sizeof(Vertex), 0,
        error, cluster > 0 ? meshopt_SimplifyLockBorder : 0, nullptr));
    result.insert(result.end(), simple.begin(), simple.end());
  }
  return result;
}

void write(const char *path, const Mesh &mesh,
           const std::vector<unsigned> &indices) {
  FILE *file = std::fopen(path, "w");
  if (!file) {
    std::perror(path);
    std::exit(1);
  }
  std::vector<int> places(mesh.vertices.size(), 0);
  int next = 1;
  for (unsigned i : indices) {
    if (places[i] != 0)
      continue;
    places[i] = next++;
    const Vertex &v = mesh.vertices[i];
    std::fprintf(file, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\n", v.position.x,
                 v.position.y, v.position.z, v.normal.x, v.normal.y,
                 v.normal.z);
  }
  for (size_t i = 0; i < indices.size(); i += 3)
    std::fprintf(file, "f %1$d//%1$d %2$d//%2$d %3$d//%3$d\n",
                 places[indices[i]], places[indices[i + 1]],
                 places[indices[i + 2]]);
  std::fclose(file);
}

} // namespace

int main(int argc, char **argv) {
  if (argc != 8 && argc != 11) {
    std::fprintf(stderr, "usage: simplify MESH OUT.obj PIXELS CLUSTER WIDTH "
                         "HEIGHT FOVY [EYE-X Y Z]\n");
    return 1;
  }
  auto number = [&](int i) { return float(std::atof(argv[i])); };
  Mesh mesh = load(argv[1]);
  Extremes extremes(mesh.vertices);
  float width = number(5), height = number(6);
  float tangent = std::tan(number(7) * std::numbers::pi_v<float> / 360);
  float half = std::atan(tangent * std::min(1.0f, width / height));
  View view{extremes.center, 2 * tangent / height};
  if (argc == 11)
    view.eye = {number(8), number(9), number(10)};
  else
    view.eye.z += extremes.radius / std::sin(half);
  std::vector<unsigned> simple =
      simplify(mesh, view, number(3), size_t(number(4)));
  std::printf("%zu %zu\n", mesh.indices.size() / 3, simple.size() / 3);
  for (unsigned i : extremes.vertices)
    simple.insert(simple.end(), 3, i);
  write(argv[2], mesh, simple);
}
