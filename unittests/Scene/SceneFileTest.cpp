//===- SceneFileTest.cpp - Scenes of all formats, and broken ones ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "PackedFile.h"
#include "Piko/Scene/SceneFile.h"

#include <cstring>
#include <zlib.h>

using namespace piko::render;
using piko::scene::Triangle;

namespace {

class SceneFile : public TemporaryFolder {
protected:
  /// The error of a file, which must name it.
  std::string errorOf(const std::string &path) {
    auto mesh = loadMesh(path);
    if (mesh)
      return "no error";
    EXPECT_NE(mesh.error().message.find("'" + path + "'"), std::string::npos)
        << mesh.error().message;
    return mesh.error().message;
  }
};

/// A roof: two squares at a right angle, that share an edge of two vertices.
const char *const roofObj = R"(# a roof
v -1 0 0
v -1 0 1
v 0 1 0
v 0 1 1
v 1 0 0
v 1 0 1
f 1 2 4 3
f 3 4 6 5
)";

bool contains(const std::string &text, const std::string &part) {
  return text.find(part) != std::string::npos;
}

TEST_F(SceneFile, ObjSharesVerticesAsTheFileDoes) {
  auto mesh = loadMesh(write("roof.obj", roofObj));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 4u);
  ASSERT_EQ(mesh->vertices.size(), 6u);
  for (size_t i = 0; i < mesh->vertices.size(); ++i)
    EXPECT_EQ(mesh->vertices[i].index, int(i));
  for (size_t i = 0; i < mesh->triangles.size(); ++i) {
    const Triangle &t = mesh->triangles[i];
    EXPECT_EQ(t.index, int(i));
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(t.vertex[k] >= 0 && t.vertex[k] < 6);
  }
}

TEST_F(SceneFile, MissingNormalsAreSmooth) {
  auto mesh = loadMesh(write("roof.obj", roofObj));
  ASSERT_TRUE(mesh);
  for (const auto &v : mesh->vertices) {
    EXPECT_NEAR(glm::length(v.normal), 1, 1e-6);
    bool isRidge = v.position.y == 1;
    // On the ridge the areas of both sides count; the sides face up and out.
    if (isRidge) {
      EXPECT_GT(v.normal.y, 0.9f);
      EXPECT_LT(std::abs(v.normal.x), 0.4f);
    } else {
      EXPECT_NEAR(v.normal.y, std::sqrt(0.5f), 1e-6f);
    }
  }
}

TEST_F(SceneFile, NormalsWeighByArea) {
  // A small triangle in the xy plane and one of four times its area in yz.
  auto mesh = loadMesh(write("corner.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
                                           "v 0 4 0\nv 0 0 1\n"
                                           "f 1 2 3\nf 1 4 5\n"));
  ASSERT_TRUE(mesh);
  for (const auto &v : mesh->vertices)
    if (v.position == glm::vec3(0)) {
      EXPECT_NEAR(v.normal.x / v.normal.z, 4, 1e-5);
      EXPECT_EQ(v.normal.y, 0);
    }
}

TEST_F(SceneFile, NormalsOfTheFileAreKeptAndNormalized) {
  auto mesh = loadMesh(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
                                         "vn 0 3 4\nf 1//1 2//1 3//1\n"));
  ASSERT_TRUE(mesh);
  ASSERT_EQ(mesh->vertices.size(), 3u);
  for (const auto &v : mesh->vertices) {
    EXPECT_NEAR(v.normal.y, 0.6f, 1e-6f);
    EXPECT_NEAR(v.normal.z, 0.8f, 1e-6f);
  }
}

TEST_F(SceneFile, PlyKeepsItsVertices) {
  // Two of the vertices are at the same place.
  std::string ply = "ply\nformat ascii 1.0\nelement vertex 5\n"
                    "property float x\nproperty float y\nproperty float z\n"
                    "element face 2\nproperty list uchar int vertex_indices\n"
                    "end_header\n"
                    "0 0 0\n1 0 0\n1 1 0\n0 0 0\n0 1 0\n3 0 1 2\n3 3 2 4\n";
  auto mesh = loadMesh(write("two.ply", ply));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 2u);
  EXPECT_EQ(mesh->vertices.size(), 5u);
}

TEST_F(SceneFile, Gzipped) {
  for (const char *name : {"roof.obj.gz", "ROOF.OBJ.gz"}) {
    gzFile file = gzopen(pathOf(name).c_str(), "wb");
    gzwrite(file, roofObj, unsigned(std::strlen(roofObj)));
    gzclose(file);
    auto mesh = loadMesh(pathOf(name));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 4u);
  }
}

TEST_F(SceneFile, Stl) {
  auto mesh =
      loadMesh(write("one.stl", "solid one\n facet normal 0 0 1\n"
                                "  outer loop\n   vertex 0 0 0\n"
                                "   vertex 1 0 0\n   vertex 0 1 0\n"
                                "  endloop\n endfacet\nendsolid one\n"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 1u);
  EXPECT_EQ(mesh->vertices[0].normal, glm::vec3(0, 0, 1));
}

/// One triangle in a node that is moved, and in one that is mirrored and
/// scaled. Its buffer lies in a file of its own.
TEST_F(SceneFile, GltfAppliesTransforms) {
  float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  write("triangle.bin",
        std::string(reinterpret_cast<const char *>(corners), sizeof corners));
  auto mesh = loadMesh(write("two.gltf", R"({"asset": {"version": "2.0"},
    "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0, "translation": [10, 0, 0]},
              {"mesh": 0, "scale": [-2, 1, 1]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"uri": "triangle.bin", "byteLength": 36}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3,
      "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]})"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->triangles.size(), 2u);
  float least = 0, most = 0;
  for (const auto &v : mesh->vertices) {
    least = std::min(least, v.position.x);
    most = std::max(most, v.position.x);
  }
  EXPECT_EQ(most, 11);
  EXPECT_EQ(least, -2);
  // The mirrored triangle still shows its front to +z.
  for (const Triangle &t : mesh->triangles) {
    glm::vec3 a = mesh->vertices[t.vertex.x].position;
    glm::vec3 b = mesh->vertices[t.vertex.y].position;
    glm::vec3 c = mesh->vertices[t.vertex.z].position;
    EXPECT_GT(glm::cross(b - a, c - a).z, 0);
    EXPECT_EQ(mesh->vertices[t.vertex.x].normal, glm::vec3(0, 0, 1));
  }
}

TEST_F(SceneFile, ReportsProgress) {
  double last = -1;
  std::string path = write("roof.obj", roofObj);
  ASSERT_TRUE(loadMesh(path, [&](double part) { last = part; }));
  EXPECT_GE(last, 0);
}

TEST_F(SceneFile, MissingFile) {
  EXPECT_TRUE(contains(errorOf(pathOf("none.obj")), "No such file"));
  EXPECT_TRUE(contains(errorOf(folder.string()), "it is a folder"));
}

TEST_F(SceneFile, BrokenFiles) {
  EXPECT_NE(errorOf(write("text.txt", "hello")), "no error");
  EXPECT_NE(errorOf(write("empty.obj", "")), "no error");
  EXPECT_NE(errorOf(write("cut.glb", "glTF\2\0\0\0")), "no error");
  EXPECT_NE(errorOf(write("bad.gltf", "{\"asset\": ")), "no error");
  EXPECT_NE(errorOf(write("far.obj", "v 0 0 0\nf 1 2 9\n")), "no error");
}

TEST_F(SceneFile, BrokenPly) {
  const std::string start = "ply\nformat ascii 1.0\n";
  const std::string vertices = "element vertex 3\nproperty float x\n"
                               "property float y\nproperty float z\n";
  const std::string faces = "element face 1\n"
                            "property list uchar int vertex_indices\n";
  const std::string rest = vertices + faces + "end_header\n";
  auto fails = [&](const std::string &content, const std::string &why) {
    std::string error = errorOf(write("broken.ply", content));
    EXPECT_TRUE(contains(error, why)) << error;
  };
  fails(start + "element ver", "its header has no end");
  fails(start + "element vertex\nend_header\n", "without a count");
  fails(start + "property float x\nend_header\n", "before any element");
  fails(start + vertices + "property huge w\nend_header\n",
        "unknown type 'huge'");
  fails("ply\nformat bcd 1.0\n" + rest, "unknown format 'bcd'");
  fails("ply\nformat ascii 2.0\n" + rest, "version 1.0 of PLY, but got '2.0'");
  fails("ply\nformat ascii\n" + rest, "version 1.0 of PLY, but got ''");
  fails(start + rest + "0 0 0\n1 0 0\n", "it is cut short");
  fails("ply\nformat binary_little_endian 1.0\n" + rest +
            std::string(36, '\0') + "\3\1",
        "it is cut short");
  fails(start + rest + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "vertex 7 of 3");
}

/// A PLY file of two vertices without faces, each with these floats.
std::string makePoints(const std::vector<std::string> &properties,
                       const std::string &before = "") {
  std::string header =
      "ply\nformat binary_little_endian 1.0\n" + before + "element vertex 2\n";
  for (const std::string &name : properties)
    header += "property float " + name + "\n";
  return header + "end_header\n" + std::string(1000, '\0');
}

TEST_F(SceneFile, PlyWithoutFaces) {
  auto fails = [&](const std::string &content, const std::string &kind) {
    std::string error = errorOf(write("points.ply", content));
    EXPECT_TRUE(contains(error, "expected triangles, but it holds 2 " + kind +
                                    ", which are not supported as a scene: "
                                    "feed them to a pipeline from an "
                                    "application"))
        << error;
  };
  fails(makePoints({"x", "y", "z"}), "points without faces");
  fails(makePoints({"x", "y", "z"}, "element face 0\n"
                                    "property list uchar int vertex_indices\n"),
        "points without faces");
  fails(makePoints({"x", "y", "z", "scale_0", "scale_1", "scale_2", "f_dc_0",
                    "f_dc_1", "f_dc_2", "opacity", "rot_0", "rot_1", "rot_2",
                    "rot_3"}),
        "Gaussian splats");
  fails(makePoints({"packed_position", "packed_rotation", "packed_scale",
                    "packed_color"},
                   "element chunk 1\nproperty float min_x\n"),
        "packed Gaussian splats (.compressed.ply)");
  // A mesh may have more to its vertices.
  auto mesh = loadMesh(write(
      "mesh.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                  "property float y\nproperty float z\nproperty float opacity\n"
                  "element face 1\nproperty list uchar int vertex_indices\n"
                  "end_header\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n"));
  EXPECT_TRUE(mesh) << mesh.error().message;
}

/// A glTF file of one triangle that requires an extension.
std::string makeGltf(const std::string &extension) {
  return R"({"asset": {"version": "2.0"}, "extensionsUsed": [")" + extension +
         R"("], "extensionsRequired": [")" + extension +
         R"("],
    "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;)"
         R"(base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3,
      "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]})";
}

/// The JSON as the first chunk of a GLB file.
std::string makeGlb(std::string json) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  auto word = [](uint32_t number) {
    return std::string(reinterpret_cast<const char *>(&number), 4);
  };
  uint32_t size = uint32_t(json.size());
  return "glTF" + word(2) + word(20 + size) + word(size) + "JSON" + json;
}

TEST_F(SceneFile, GltfExtensions) {
  const std::string remedy = ": convert it, as with 'gltf-transform ";
  const std::pair<const char *, std::string> extensions[] = {
      {"KHR_draco_mesh_compression", remedy + "cp in.glb out.glb'"},
      {"EXT_meshopt_compression", remedy + "cp in.glb out.glb'"},
      {"ACME_folded_space", ""}};
  for (const auto &[name, hint] : extensions) {
    std::string expected = std::string("it requires the glTF extension '") +
                           name + "', which is not supported" + hint;
    std::string json = makeGltf(name);
    EXPECT_TRUE(errorOf(write("a.gltf", json)).ends_with(expected));
    EXPECT_TRUE(errorOf(write("a.glb", makeGlb(json))).ends_with(expected));
  }
  // Textures and materials are not taken from a scene.
  for (const char *name :
       {"KHR_texture_basisu", "KHR_materials_unlit", "KHR_mesh_quantization",
        "EXT_mesh_gpu_instancing"}) {
    auto mesh = loadMesh(write("a.gltf", makeGltf(name)));
    EXPECT_TRUE(mesh) << mesh.error().message;
    // Its buffer is in a data URI, though there could be a chunk.
    auto packed = loadMesh(write("a.glb", makeGlb(makeGltf(name))));
    ASSERT_TRUE(packed) << packed.error().message;
    EXPECT_EQ(packed->triangles.size(), 1u);
  }
}

TEST_F(SceneFile, NamesWithSpaces) {
  std::filesystem::create_directory(folder / "my scenes (1)");
  const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  write("my scenes (1)/cor ners #1.bin",
        std::string(reinterpret_cast<const char *>(corners), sizeof corners));
  std::string json = makeGltf("KHR_materials_unlit");
  size_t begin = json.find("data:"), end = json.find('"', begin);
  for (const char *uri : {"cor ners #1.bin", "cor%20ners%20%231.bin"}) {
    json.replace(begin, end - begin, uri);
    end = begin + std::strlen(uri);
    auto mesh = loadMesh(write("my scenes (1)/a b.gltf", json));
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 1u);
  }
  auto roof = loadMesh(write("my scenes (1)/a roof.obj", roofObj));
  ASSERT_TRUE(roof) << roof.error().message;
}

TEST_F(SceneFile, GzipOfMoreThanMemory) {
  std::string path = pathOf("zeros.obj.gz"), zeros(1000000, '\0');
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  EXPECT_TRUE(readFile(path, zeros.size()));
  auto content = readFile(path, zeros.size() - 1);
  ASSERT_FALSE(content);
  EXPECT_EQ(content.error().message,
            "it is, or unpacks to, more than the machine's memory of 999999 "
            "bytes");
}

TEST_F(SceneFile, BrokenGzip) {
  std::string whole = pathOf("roof.obj.gz");
  gzFile file = gzopen(whole.c_str(), "wb");
  gzwrite(file, roofObj, unsigned(std::strlen(roofObj)));
  gzclose(file);
  std::ifstream stream(whole, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_TRUE(
      contains(errorOf(write("cut.obj.gz", bytes.substr(0, bytes.size() / 2))),
               "does not unpack"));
}

TEST_F(SceneFile, NoTriangles) {
  EXPECT_TRUE(contains(errorOf(write("line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")),
                       "it holds no triangles"));
}

TEST_F(SceneFile, PositionsThatAreNotFinite) {
  EXPECT_TRUE(contains(
      errorOf(write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")),
      "not finite"));
}

} // namespace
