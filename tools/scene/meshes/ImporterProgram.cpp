//===- ImporterProgram.cpp - piko-import, which reads other formats -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   piko-import FILE
//
// Reads a scene by assimp and writes it to the standard output as a PLY file,
// or says what is wrong with it and ends with 1. It is a program of its own,
// because assimp has assertions, and reads what it should not, on files that
// are not what they seem; so it is taken to be as right as a file is. See
// ImportProcess.h.
//
//===----------------------------------------------------------------------===//
#include "ImportProcess.h"
#include "MeshBuilder.h"
#include "PackedFile.h"

#include "Piko/CommandLine/CommandLine.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <cctype>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <sys/resource.h>

using namespace piko;
using namespace piko::render;

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

/// The first line of what assimp has to say.
std::string messageOf(const Assimp::Importer &importer) {
  std::string message = importer.GetErrorString();
  if (size_t end = message.find('\n'); end != std::string::npos)
    message.resize(end);
  while (message.ends_with('.'))
    message.pop_back();
  // Of a sentence; names of formats stay as they are.
  if (message.size() > 1 &&
      std::islower(static_cast<unsigned char>(message[1])))
    message[0] = char(std::tolower(static_cast<unsigned char>(message[0])));
  return message.empty() ? "no importer reads it" : message;
}

Result<Mesh> import(const std::string &path) {
  std::error_code problem;
  if (auto status = std::filesystem::status(path, problem);
      !std::filesystem::exists(status))
    return Error{problem.message()};
  else if (std::filesystem::is_directory(status))
    return Error{"it is a folder"};
  Assimp::Importer importer;
  const aiScene *imported;
  // Other formats may consist of several files, which the importer finds.
  if (path.ends_with(".gz")) {
    auto content = readFile(path);
    if (!content)
      return content.error();
    std::string format = formatOf(path);
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

/// Little-endian, as all machines are that the compiler knows.
void writePly(const Mesh &mesh) {
  std::printf("ply\nformat binary_little_endian 1.0\nelement vertex %zu\n"
              "property float x\nproperty float y\nproperty float z\n"
              "property float nx\nproperty float ny\nproperty float nz\n"
              "element face %zu\nproperty list uchar int vertex_indices\n"
              "end_header\n",
              mesh.vertices.size(), mesh.triangles.size());
  for (const scene::Vertex &v : mesh.vertices) {
    float numbers[6] = {v.position.x, v.position.y, v.position.z,
                        v.normal.x,   v.normal.y,   v.normal.z};
    std::fwrite(numbers, sizeof numbers, 1, stdout);
  }
  for (const scene::Triangle &t : mesh.triangles) {
    std::putchar(3);
    std::fwrite(&t.vertex, sizeof t.vertex, 1, stdout);
  }
}

/// What never ends is ended.
void limitTime() {
  rlimit seconds{importSeconds, importSeconds};
  setrlimit(RLIMIT_CPU, &seconds);
  rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
}

int fail(const Error &error) {
  std::fprintf(stderr, "piko-import: error: %s\n", error.message.c_str());
  return 1;
}

/// The exit status, once all is written.
int finish() {
  auto ok = piko::support::finishOutput();
  return ok ? 0 : fail(ok.error());
}

} // namespace

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-import");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  CommandLine line("piko-import FILE",
                   "Reads a scene of a format that piko-render does not read "
                   "itself, and writes it as PLY to the standard output. "
                   "piko-render calls it.",
                   "piko-import teapot.3ds > teapot.ply");
  std::string file;
  line.addText("FILE", "", file, "what assimp reads, gzipped or not");
  auto help = line.read({argv + 1, argv + argc});
  if (!help)
    return fail(help.error());
  if (!help->empty()) {
    std::fputs(help->c_str(), stdout);
    return finish();
  }
  if (file.empty())
    return fail({"expected a scene's file"});
  limitTime();
  std::optional<Progress> progress("loading " + file);
  auto mesh = import(file);
  progress.reset();
  if (!mesh)
    return fail({describeLoad(file) + mesh.error().message});
  writePly(*mesh);
  return finish();
}
