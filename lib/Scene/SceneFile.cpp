//===- SceneFile.cpp - Meshes and patches from files ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/SceneFile.h"

#include "GltfFile.h"
#include "MeshBuilder.h"
#include "MeshReaders.h"
#include "PatchFile.h"

#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

namespace {

glm::vec3 toVec3(const aiVector3D &v) { return {v.x, v.y, v.z}; }

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
class ImportedScene {
public:
  /// Joins equal vertices in meshes that are `toJoin`.
  ImportedScene(const aiScene &imported, std::vector<bool> toJoin)
      : imported(imported), toJoin(std::move(toJoin)) {}

  Result<Mesh> build() {
    if (imported.mRootNode)
      addNode(*imported.mRootNode, aiMatrix4x4());
    return builder.finish();
  }

private:
  void addNode(const aiNode &node, const aiMatrix4x4 &parent) {
    aiMatrix4x4 toWorld = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      addMesh(*imported.mMeshes[node.mMeshes[i]], toJoin[node.mMeshes[i]],
              toWorld);
    for (unsigned i = 0; i < node.mNumChildren; ++i)
      addNode(*node.mChildren[i], toWorld);
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
        places[i] = builder.addVertex(toVec3(toWorld * part.mVertices[i]),
                                      normal, join);
      }
      return places[i];
    };
    for (unsigned f = 0; f < part.mNumFaces && !builder.hasFailed(); ++f) {
      const aiFace &face = part.mFaces[f];
      if (face.mNumIndices != 3) // a point or a line
        continue;
      glm::ivec3 corners = {place(face.mIndices[0]), place(face.mIndices[1]),
                            place(face.mIndices[2])};
      if (isMirrored)
        std::swap(corners.y, corners.z);
      builder.addTriangle(corners);
    }
  }

  const aiScene &imported;
  std::vector<bool> toJoin;
  MeshBuilder builder;
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

/// The content of a file as it is.
Result<std::string> readRaw(const fs::path &path) {
  std::ifstream stream(path, std::ios::binary);
  std::string content;
  if (!stream || !fs::is_regular_file(path))
    return Error{"cannot read '" + path.string() + "'"};
  content.assign(std::istreambuf_iterator<char>(stream), {});
  return content;
}

/// Opens files that a glTF file names, beside it: by their names with percent
/// codes decoded, or as they are.
OpenFile openBeside(const std::string &path) {
  return [folder = fs::path(path).parent_path()](const std::string &name) {
    std::string decoded = decodePercents(name);
    if (decoded.find('\0') != decoded.npos)
      return Result<std::string>(Error{"a file's name holds a zero"});
    auto content = readRaw(folder / decoded);
    return content || decoded == name ? content : readRaw(folder / name);
  };
}

bool isOwnFormat(const std::string &format) {
  return format == ".ply" || format == ".obj" || format == ".stl" ||
         format == ".gltf" || format == ".glb";
}

/// Reads a file of a format that has a reader of its own.
Result<Mesh> loadOwn(const std::string &path, const std::string &format,
                     const ProgressFunction &progress) {
  auto content = readFile(path);
  if (!content)
    return content.error();
  if (progress)
    progress(0.5); // half of it is reading, as a rule
  Result<Mesh> mesh = format == ".ply"   ? readPly(*content)
                      : format == ".obj" ? readObj(*content)
                      : format == ".stl" ? readStl(*content)
                                         : readGltf(*content, openBeside(path));
  if (progress)
    progress(1);
  return mesh;
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
  if (isOwnFormat(format))
    return loadOwn(path, format, progress);
  Assimp::Importer importer;
  if (progress) // the importer owns it
    importer.SetProgressHandler(new ReportProgress(progress));
  const aiScene *imported;
  // Other formats may consist of several files, which the importer finds.
  if (path.ends_with(".gz")) {
    auto content = readFile(path);
    if (!content)
      return content.error();
    imported = importer.ReadFileFromMemory(content->data(), content->size(), 0,
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
  return ImportedScene(*imported, std::move(*toJoin)).build();
}

} // namespace

Result<Mesh> render::loadMesh(const std::string &path,
                              const ProgressFunction &progress) {
  auto mesh = load(path, progress);
  if (!mesh)
    return Error{"cannot load scene '" + path + "': " + mesh.error().message};
  return mesh;
}
