//===- SceneFile.cpp - Meshes and patches from files ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/SceneFile.h"

#include "GltfCheck.h"
#include "PatchFile.h"
#include "PlyCheck.h"
#include "Vectors.h"

#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <zlib.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <unordered_map>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

namespace {

glm::vec3 toVec3(const aiVector3D &v) { return {v.x, v.y, v.z}; }

glm::vec3 normalizeOr(glm::vec3 v, glm::vec3 otherwise) {
  float length = std::sqrt(glm::dot(v, v));
  return length > 0 && std::isfinite(length) ? v * (1 / length) : otherwise;
}

/// Position and normal, bit by bit. Vertices without a normal have none of
/// unit length, so they join no vertex that has one.
using VertexKey = std::array<uint32_t, 6>;

VertexKey makeKey(glm::vec3 position, glm::vec3 normal) {
  VertexKey key;
  for (int i = 0; i < 3; ++i) {
    key[i] = std::bit_cast<uint32_t>(position[i] + 0.0f); // -0 is 0
    key[i + 3] = std::bit_cast<uint32_t>(normal[i] + 0.0f);
  }
  return key;
}

struct HashVertexKey {
  size_t operator()(const VertexKey &key) const {
    uint64_t hash = 0x9e3779b97f4a7c15;
    for (uint32_t word : key) {
      hash = (hash ^ word) * 0xff51afd7ed558ccd;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

/// For each mesh of a scene that was just imported, whether no two of its
/// polygons share a vertex: importers of OBJ and STL give each corner its own,
/// even where the file shares them. The error is an index out of range.
Result<std::vector<bool>> findUnshared(const aiScene &imported) {
  std::vector<bool> isUnshared;
  for (unsigned m = 0; m < imported.mNumMeshes; ++m) {
    const aiMesh &part = *imported.mMeshes[m];
    size_t corners = 0;
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace &face = part.mFaces[f];
      corners += face.mNumIndices;
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        if (face.mIndices[k] >= part.mNumVertices)
          return Error{"a face names vertex " +
                       std::to_string(face.mIndices[k]) + " of " +
                       std::to_string(part.mNumVertices)};
    }
    isUnshared.push_back(corners == part.mNumVertices);
  }
  return isUnshared;
}

/// Gathers the triangles of an imported scene.
class MeshBuilder {
public:
  /// Joins equal vertices in meshes that are `toJoin`.
  explicit MeshBuilder(std::vector<bool> toJoin) : toJoin(std::move(toJoin)) {}

  Result<Mesh> build(const aiScene &imported) {
    if (imported.mRootNode)
      addNode(imported, *imported.mRootNode, aiMatrix4x4());
    if (!problem.empty())
      return Error{problem};
    if (mesh.triangles.empty())
      return Error{"it holds no triangles"};
    smoothNormals();
    return std::move(mesh);
  }

private:
  void addNode(const aiScene &imported, const aiNode &node,
               const aiMatrix4x4 &parent) {
    aiMatrix4x4 toWorld = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      addMesh(*imported.mMeshes[node.mMeshes[i]], toJoin[node.mMeshes[i]],
              toWorld);
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      addNode(imported, *node.mChildren[i], toWorld);
  }

  void addMesh(const aiMesh &part, bool join, const aiMatrix4x4 &toWorld) {
    aiMatrix3x3 normalToWorld(toWorld);
    bool isMirrored = normalToWorld.Determinant() < 0;
    normalToWorld.Inverse().Transpose();
    std::vector<int32_t> places(part.mNumVertices, -1);
    auto place = [&](unsigned i) {
      if (places[i] < 0) {
        glm::vec3 normal(0);
        if (part.HasNormals())
          normal =
              normalizeOr(toVec3(normalToWorld * part.mNormals[i]), {0, 0, 1});
        places[i] =
            addVertex(toVec3(toWorld * part.mVertices[i]), normal, join);
      }
      return places[i];
    };
    for (unsigned f = 0; f < part.mNumFaces && problem.empty(); ++f) {
      const aiFace &face = part.mFaces[f];
      if (face.mNumIndices != 3) // a point or a line
        continue;
      glm::ivec3 corners = {place(face.mIndices[0]), place(face.mIndices[1]),
                            place(face.mIndices[2])};
      if (isMirrored)
        std::swap(corners.y, corners.z);
      addTriangle(corners);
    }
  }

  int32_t addVertex(glm::vec3 position, glm::vec3 normal, bool join) {
    if (!isFinite(position))
      fail("the position of a vertex is not finite");
    size_t next = mesh.vertices.size();
    if (next == std::numeric_limits<int32_t>::max())
      fail("it holds more than 2^31 vertices");
    if (join) {
      auto [known, isNew] =
          joined.try_emplace(makeKey(position, normal), int32_t(next));
      if (!isNew)
        return known->second;
    }
    mesh.vertices.push_back({position, normal, int32_t(next)});
    return int32_t(next);
  }

  void addTriangle(glm::ivec3 corners) {
    size_t next = mesh.triangles.size();
    if (next == std::numeric_limits<int32_t>::max())
      return fail("it holds more than 2^31 triangles");
    mesh.triangles.push_back({corners, int32_t(next)});
  }

  /// Gives vertices without a normal the area-weighted mean of those of the
  /// triangles around them.
  void smoothNormals() {
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

  void fail(const std::string &message) {
    if (problem.empty())
      problem = message;
  }

  std::vector<bool> toJoin;
  Mesh mesh;
  std::unordered_map<VertexKey, int32_t, HashVertexKey> joined;
  std::string problem;
};

/// Passes on how far assimp has got.
class ReportProgress : public Assimp::ProgressHandler {
public:
  explicit ReportProgress(const ProgressFunction &report) : report(report) {}
  bool Update(float part) override {
    if (part >= 0)
      report(part);
    return true;
  }

private:
  const ProgressFunction &report;
};

/// The content of a file, unpacked if it is gzipped.
Result<std::string> readFile(const std::string &path) {
  gzFile file = gzopen(path.c_str(), "rb");
  if (!file)
    return Error{std::strerror(errno)};
  std::string content;
  std::vector<char> chunk(1 << 20);
  int got;
  while ((got = gzread(file, chunk.data(), unsigned(chunk.size()))) > 0)
    content.append(chunk.data(), size_t(got));
  int code;
  std::string message = gzerror(file, &code);
  bool isWhole = gzclose_r(file) == Z_OK && got == 0 && code == Z_OK;
  if (!isWhole)
    return Error{"it does not unpack: " +
                 (message.empty() ? "it is cut short" : message)};
  return content;
}

/// The extension that says the format, without ".gz": lowercase and with its
/// dot.
std::string formatOf(fs::path path) {
  if (path.extension() == ".gz")
    path = path.stem();
  std::string format = path.extension().string();
  for (char &c : format)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return format;
}

/// The first line of what assimp has to say.
std::string messageOf(const Assimp::Importer &importer) {
  std::string message = importer.GetErrorString();
  if (size_t end = message.find('\n'); end != std::string::npos)
    message.resize(end);
  return message.empty() ? "no importer reads it" : message;
}

Result<Mesh> loadPatches(const std::string &path) {
  auto content = readFile(path);
  if (!content)
    return content.error();
  auto patches = readPatches(*content);
  if (!patches)
    return patches.error();
  Mesh mesh;
  mesh.patches = std::move(*patches);
  return mesh;
}

/// What is wrong with a file that assimp would not say; "" if nothing is.
std::string check(const std::string &format, const std::string &content) {
  if (format == ".ply")
    return checkPly(content);
  return format == ".gltf" || format == ".glb" ? checkGltf(content) : "";
}

Result<Mesh> load(const std::string &path, const ProgressFunction &progress) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    return Error{"it is a folder"};
  if (FILE *file = std::fopen(path.c_str(), "rb"))
    std::fclose(file);
  else
    return Error{std::strerror(errno)};

  std::string format = formatOf(path);
  if (format == ".bpt")
    return loadPatches(path);
  Assimp::Importer importer;
  if (progress) // the importer owns it
    importer.SetProgressHandler(new ReportProgress(progress));
  const aiScene *imported;
  bool isPacked = path.ends_with(".gz"), isPly = format == ".ply";
  std::string content;
  if (isPacked || isPly || format == ".gltf" || format == ".glb") {
    auto read = readFile(path);
    if (!read)
      return read.error();
    content = std::move(*read);
    if (std::string problem = check(format, content); !problem.empty())
      return Error{problem};
  }
  // Other formats may consist of several files, which the importer finds.
  if (isPacked || isPly) {
    imported = importer.ReadFileFromMemory(content.data(), content.size(), 0,
                                           format.c_str() + !format.empty());
  } else {
    imported = importer.ReadFile(path, 0);
  }
  if (!imported)
    return Error{messageOf(importer)};
  auto toJoin = findUnshared(*imported);
  if (!toJoin)
    return toJoin.error();
  imported = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (!imported)
    return Error{messageOf(importer)};
  return MeshBuilder(std::move(*toJoin)).build(*imported);
}

} // namespace

Result<Mesh> render::loadMesh(const std::string &path,
                              const ProgressFunction &progress) {
  auto mesh = load(path, progress);
  if (!mesh)
    return Error{"cannot load scene '" + path + "': " + mesh.error().message};
  return mesh;
}
