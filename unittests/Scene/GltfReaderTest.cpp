//===- GltfReaderTest.cpp - What glTF files may say -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "MeshReaders.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

using namespace piko::render;

namespace {

/// A square of four corners, in the order of a strip, the indices 0, 1, 2 and
/// 2, 1, 3, then the corners in bytes, four to each.
std::string makeData() {
  std::string data;
  for (float value :
       {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 1.f, 0.f})
    data.append(reinterpret_cast<const char *>(&value), 4);
  for (uint16_t index : {0, 1, 2, 2, 1, 3})
    data.append(reinterpret_cast<const char *>(&index), 2);
  return data + std::string("\0\0\0\0\2\0\0\0\0\2\0\0\2\2\0\0", 16);
}

/// The parts of a file; each is put in place of what stands there otherwise.
struct Parts {
  std::string nodes = R"({"mesh":0})";
  std::string primitive = R"("attributes":{"POSITION":0},"mode":5)";
  std::string positions = R"("bufferView":0,"componentType":5126,"count":4)";
  std::string indices = R"("bufferView":1,"componentType":5123,"count":6)";
  std::string view = R"("byteLength":48)";
  std::string root = R"("scenes":[{"nodes":[0]}])";
  std::string mesh = "";
  std::string asset = R"("version":"2.0")";
  std::string length = "76";
};

std::string makeFile(const Parts &parts) {
  return R"({"asset":{)" + parts.asset + "}," + parts.root + R"(,"nodes":[)" +
         parts.nodes + R"(],"meshes":[{)" + parts.mesh + R"("primitives":[{)" +
         parts.primitive + R"(}]}],"accessors":[{)" + parts.positions +
         R"(,"type":"VEC3"},{)" + parts.indices +
         R"(,"type":"SCALAR"},{"bufferView":2,"componentType":5120,"count":4,)"
         R"("type":"VEC3"}],"bufferViews":[{"buffer":0,)" +
         parts.view + R"(},{"buffer":0,"byteOffset":48,"byteLength":12},)" +
         R"({"buffer":0,"byteOffset":60,"byteLength":16,"byteStride":4}],)" +
         R"("buffers":[{"uri":"a%20b.bin","byteLength":)" + parts.length +
         "}]}";
}

/// "T of A%", where A is what faces +z less what faces -z, and the warnings; or
/// the error.
std::string read(const Parts &parts) {
  auto mesh = readGltf(makeFile(parts), [](const std::string &name) {
    return name == "a%20b.bin" ? Result<std::string>(makeData())
                               : Result<std::string>(Error{"no " + name});
  });
  if (!mesh)
    return mesh.error().message;
  double area = 0;
  for (const auto &t : mesh->triangles) {
    glm::vec3 a = mesh->vertices[t.vertex.x].position;
    glm::vec3 b = mesh->vertices[t.vertex.y].position;
    glm::vec3 c = mesh->vertices[t.vertex.z].position;
    area += double(glm::cross(b - a, c - a).z) / 2;
  }
  std::string text = std::to_string(mesh->triangles.size()) + " of " +
                     std::to_string(std::lround(area * 100)) + "%";
  for (const std::string &warning : mesh->warnings)
    text += "; " + warning;
  return text;
}

const std::string indexed = R"("attributes":{"POSITION":0},"indices":1)";

TEST(GltfReader, Primitives) {
  EXPECT_EQ(read({}), "2 of 100%");
  EXPECT_EQ(read({.primitive = indexed}), "2 of 100%");
  EXPECT_EQ(read({.primitive = indexed + R"(,"mode":5)"}), "4 of 0%");
  EXPECT_EQ(read({.primitive = R"("attributes":{"POSITION":0},"mode":6)"}),
            "2 of 0%");
  EXPECT_EQ(read({.primitive = R"("attributes":{"POSITION":0},"mode":1)"}),
            "it holds no triangles");
  EXPECT_EQ(read({.primitive = R"("attributes":{"POSITION":0})"}),
            "1 of 50%; meshes[0].primitives[0] has 1 vertices after its last "
            "triangle");
  EXPECT_EQ(read({.primitive = R"("attributes":{"POSITION":0},"mode":9)"}),
            "meshes[0].primitives[0] has the unknown mode 9");
  for (const char *count : {"1", "2"})
    EXPECT_EQ(
        read({.positions = std::string(R"("bufferView":0,)"
                                       R"("componentType":5126,"count":)") +
                           count}),
        "it holds no triangles");
}

TEST(GltfReader, Accessors) {
  EXPECT_EQ(read({.positions = R"("componentType":5126,"count":4)"}),
            "2 of 0%");
  EXPECT_EQ(read({.positions = R"("componentType":5126,"count":2000000000)"}),
            "accessors[0]: expected a bufferView, or not more than 1048576 "
            "elements, but got 2000000000");
  EXPECT_EQ(read({.view = R"("byteLength":48,"byteStride":4)"}),
            "accessors[0] has elements of 12 bytes, but bufferViews[0] has a "
            "byteStride of 4");
  EXPECT_EQ(read({.view = R"("byteLength":47)"}),
            "accessors[0]: 4 elements from byte 0 on are not within the 47 "
            "bytes of bufferViews[0]");
  EXPECT_EQ(read({.view = R"("byteLength":48,"byteOffset":60)"}),
            "bufferViews[0]: bytes 60 to 108 are not within the 76 of "
            "buffers[0]");
  EXPECT_EQ(read({.view = R"("byteLength":-1)"}),
            "expected a whole number as 'byteLength', but got '-1'");
  EXPECT_EQ(read({.length = "77"}),
            "buffers[0]: expected 77 bytes, but got 76");
  EXPECT_EQ(
      read({.primitive = indexed,
            .positions = R"("bufferView":0,"componentType":5126,"count":3)"}),
      "accessors[1] names vertex 3 of 3");
  EXPECT_EQ(read({.positions = R"("bufferView":0,"componentType":5126,)"
                               R"("count":4,"sparse":{"count":1,"indices":)"
                               R"({"bufferView":1,"byteOffset":10,)"
                               R"("componentType":5123},"values":)"
                               R"({"bufferView":0,"byteOffset":12}})"}),
            "2 of 50%"); // corner 3 is at corner 1
  // Every 16 bytes a corner, of which two are elsewhere.
  EXPECT_EQ(read({.positions = R"("bufferView":1,"componentType":5126,)"
                               R"("count":3,"sparse":{"count":2,"indices":)"
                               R"({"bufferView":2,"byteOffset":2,)"
                               R"("componentType":5123},"values":)"
                               R"({"bufferView":0,"byteOffset":12}})",
                  .view = R"("byteLength":48},{"buffer":0,"byteLength":48,)"
                          R"("byteStride":16)"}),
            "1 of 50%");
}

TEST(GltfReader, Versions) {
  EXPECT_EQ(read({.asset = R"("version":"2.1","minVersion":"2.0")"}),
            "2 of 100%");
  EXPECT_EQ(read({.asset = R"("version":"2.1","minVersion":"2.1")"}),
            "it needs a reader of glTF '2.1', but this one is of 2.0");
  EXPECT_EQ(read({.asset = R"("version":"1.0")"}),
            "expected glTF 2, but its 'asset' has the version '1.0'");
  EXPECT_EQ(read({.asset = ""}),
            "expected glTF 2, but its 'asset' has the version ''");
}

TEST(GltfReader, QuantizedMeshes) {
  Parts parts{.primitive = R"("attributes":{"POSITION":2},"mode":5)"};
  EXPECT_TRUE(read(parts).starts_with("accessors[2]: expected floats"));
  parts.root += R"(,"extensionsUsed":["KHR_mesh_quantization"])";
  EXPECT_EQ(read(parts), "2 of 400%");
}

TEST(GltfReader, Nodes) {
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"scale":[-3,1,1]})"}), "2 of 300%");
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"rotation":[1,0,0,0]})"}),
            "2 of -100%");
  EXPECT_EQ(read({.nodes = R"({"matrix":[2,0,0,0,0,2,0,0,0,0,2,0,5,5,5,1],)"
                           R"("children":[1]},{"mesh":0})"}),
            "2 of 400%");
  // Neither scene nor parent.
  EXPECT_EQ(read({.nodes = R"({"mesh":0},{"mesh":0,"children":[0]})",
                  .root = R"("extras":0)"}),
            "4 of 200%");
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"children":[0]})"}),
            "nodes[0] has two parents, or is its own descendant");
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"children":[7]})"}),
            "expected nodes[7], but there are 1");
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"skin":0})"}),
            "2 of 100%; nodes[0]: its skin is left out, and its mesh drawn at "
            "rest");
  EXPECT_EQ(read({.nodes = R"({"mesh":0,"extensions":{)"
                           R"("EXT_mesh_gpu_instancing":{"attributes":{)"
                           R"("TRANSLATION":0}}}})"}),
            "8 of 400%");
  EXPECT_EQ(read({.root = R"("scenes":[{"nodes":[0]}],)"
                          R"("extensionsUsed":["ACME_bent"])"}),
            "2 of 100%; the glTF extension 'ACME_bent' is not supported, and "
            "left out");
}

TEST(GltfReader, MorphTargets) {
  EXPECT_EQ(read({.primitive = R"("attributes":{"POSITION":0},"mode":5,)"
                               R"("targets":[{"POSITION":0}])",
                  .mesh = R"("weights":[1],)"}),
            "2 of 400%");
}

/// Nodes in nodes, deeper than any stack.
TEST(GltfReader, DeepTree) {
  std::string nodes;
  for (int i = 1; i < 100000; ++i)
    nodes += R"({"children":[)" + std::to_string(i) + "]},";
  EXPECT_EQ(read({.nodes = nodes + R"({"mesh":0})"}), "2 of 100%");
}

} // namespace
