//===- SceneFile.cpp - Meshes and patches from files ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/SceneFile.h"

#include "GltfFile.h"
#include "ImportProcess.h"
#include "MeshReaders.h"
#include "PackedFile.h"
#include "PatchFile.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

namespace {

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

Result<Mesh> loadAny(const std::string &path,
                     const ProgressFunction &progress) {
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
  return importMesh(path);
}

Result<Mesh> load(const std::string &path, const ProgressFunction &progress) {
  try {
    return loadAny(path, progress);
  } catch (const std::bad_alloc &) {
  } catch (const std::length_error &) { // more than there are addresses
  }
  return Error{"there is not enough memory for it"};
}

} // namespace

Result<Mesh> render::loadMesh(const std::string &path,
                              const ProgressFunction &progress) {
  auto mesh = load(path, progress);
  if (!mesh)
    return Error{describeLoad(path) + mesh.error().message};
  return mesh;
}
