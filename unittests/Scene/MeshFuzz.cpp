//===- MeshFuzz.cpp - Mutated files for the readers of meshes -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "MeshFuzz.h"

#include "MeshReaders.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

using namespace piko::render;

namespace {

enum class Format { Ply, Obj, Stl, Gltf };

struct Seed {
  Format format;
  std::string content;
};

template <class T> std::string bytesOf(std::initializer_list<T> values) {
  std::string bytes;
  for (T value : values)
    bytes.append(reinterpret_cast<const char *>(&value), sizeof(T));
  return bytes;
}

/// The other way round: as processors of the other kind write them.
template <class T> std::string swappedBytesOf(std::initializer_list<T> values) {
  std::string bytes;
  for (T value : values) {
    std::string one = bytesOf<T>({value});
    bytes.append(one.rbegin(), one.rend());
  }
  return bytes;
}

std::string squareOf() {
  return bytesOf<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
}

const char *const plyVertices =
    " 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\n";
const char *const plyText = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

void addPly(std::vector<Seed> &seeds) {
  std::string list = "property list uchar int vertex_indices\nend_header\n";
  std::string text = std::string("ply\nformat ascii") + plyVertices;
  seeds.push_back({Format::Ply, text + "element face 2\n" + list + plyText +
                                    "4 0 1 2 3\n3 2 1 0\n"});
  seeds.push_back(
      {Format::Ply, text + "element tristrips 1\n" +
                        "property list int int vertex_indices\nend_header\n" +
                        plyText + "8 0 1 2 3 -1 3 2 1\n"});
  seeds.push_back(
      {Format::Ply, std::string("ply\nformat binary_little_endian") +
                        plyVertices + "element face 2\n" + list + squareOf() +
                        "\4" + bytesOf<int32_t>({0, 1, 2, 3}) + "\3" +
                        bytesOf<int32_t>({2, 1, 0})});
  // Faces first, and lists and elements that are passed over.
  seeds.push_back(
      {Format::Ply,
       "ply\r\nformat binary_big_endian 1.0\r\ncomment a\r\n"
       "element face 2\r\nproperty uchar red\r\n"
       "property list ushort short vertex_index\r\n"
       "property list uchar float texcoord\r\nelement material 1\r\n"
       "property list uint double weights\r\nelement vertex 4\r\n"
       "property float64 x\r\nproperty float64 y\r\nproperty float64 z\r\n"
       "property float nx\r\nproperty float ny\r\nproperty float nz\r\n"
       "end_header\r\n\7" +
           swappedBytesOf<uint16_t>({4, 0, 1, 2, 3}) + "\2" +
           swappedBytesOf<float>({0.5f, 1}) + "\7" +
           swappedBytesOf<uint16_t>({3, 2, 1, 0}) + std::string(1, '\0') +
           swappedBytesOf<uint32_t>({2}) + swappedBytesOf<double>({1, 2}) +
           swappedBytesOf<double>({0, 0, 0}) +
           swappedBytesOf<float>({0, 0, 1}) +
           swappedBytesOf<double>({1, 0, 0}) +
           swappedBytesOf<float>({0, 0, 1}) +
           swappedBytesOf<double>({1, 1, 0}) +
           swappedBytesOf<float>({0, 0, 1}) +
           swappedBytesOf<double>({0, 1, 0}) +
           swappedBytesOf<float>({0, 0, 1})});
}

void addTexts(std::vector<Seed> &seeds) {
  seeds.push_back({Format::Obj, "v 0 0 0\nv 4 0 0 1 0 0\nv 4 4 0\nv 2 1 0\n"
                                "v 0 4 0\nvn 0 0 1\nvt 0 0\n# end\n"
                                "f 1//1 2 3/1 4/1/1 \\\n 5\nf -1 -2 -3\n"});
  seeds.push_back({Format::Obj, "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\n"
                                "v 1 3 0\nv 3 3 0\nv 3 1 0\n"
                                "f 1 2 3 4 1 5 6 7 8 5\n"});
  seeds.push_back({Format::Stl,
                   "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
                   "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
                   "endsolid a\n"});
  std::string binary(80, ' ');
  binary += bytesOf<uint32_t>({1});
  binary += bytesOf<float>({0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0});
  seeds.push_back({Format::Stl, binary + std::string(2, '\0')});
}

/// Strips, instances, morph targets, sparse and quantized accessors: all read
/// from one buffer of 92 bytes.
std::string makeJson(const std::string &buffer) {
  return R"({"asset":{"version":"2.0"},"extensionsUsed":[
"KHR_mesh_quantization","EXT_mesh_gpu_instancing"],"scene":0,
"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"children":[2],
"scale":[-1,1,1]},{"mesh":1,"rotation":[0,0,1,0],"extensions":
{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}},
{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}],
"meshes":[{"weights":[0.5],"primitives":[{"attributes":{"POSITION":0},
"indices":1,"targets":[{"POSITION":2}]}]},{"primitives":[{"attributes":
{"POSITION":3},"mode":5},{"attributes":{"POSITION":0},"mode":6}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},
{"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,
"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0,
"byteOffset":12}}},{"bufferView":2,"componentType":5122,"count":4,
"normalized":true,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,
"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":32,
"byteStride":8}],"buffers":[{"byteLength":92)" +
         buffer + "}]}";
}

std::string dataOfGltf() {
  return squareOf() + bytesOf<uint16_t>({0, 1, 2, 0, 2, 3}) +
         bytesOf<int16_t>({0, 0, 0, 0, 9, 0, 0, 0, 9, 9, 0, 0, 0, 9, 0, 0});
}

void addGltf(std::vector<Seed> &seeds) {
  std::string data = dataOfGltf();
  seeds.push_back({Format::Gltf, makeJson(",\"uri\":\"a%20b.bin\"")});
  std::string json = makeJson("");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  uint32_t size = uint32_t(json.size()), rest = uint32_t(data.size());
  seeds.push_back(
      {Format::Gltf, "glTF" + bytesOf<uint32_t>({2, 28 + size + rest, size}) +
                         "JSON" + json + bytesOf<uint32_t>({rest}) +
                         std::string("BIN\0", 4) + data});
}

std::string encode(const std::string &bytes) {
  constexpr const char *digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = 0;
    size_t count = std::min<size_t>(3, bytes.size() - i);
    for (size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? uint8_t(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k)
      text += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A file that holds its buffer as a data URI, also within a GLB.
void addDataUris(std::vector<Seed> &seeds) {
  std::string json =
      makeJson(",\"uri\":\"data:application/octet-stream;base64," +
               encode(dataOfGltf()) + "\"");
  seeds.push_back({Format::Gltf, json});
  json.resize((json.size() + 3) / 4 * 4, ' ');
  uint32_t size = uint32_t(json.size());
  seeds.push_back(
      {Format::Gltf,
       "glTF" + bytesOf<uint32_t>({2, 20 + size, size}) + "JSON" + json});
}

class Mutator {
public:
  explicit Mutator(uint64_t seed) : random(seed) {}

  size_t below(size_t limit) { return limit ? random() % limit : 0; }

  void mutate(std::string &text) {
    switch (below(7)) {
    case 0:
      if (!text.empty())
        text[below(text.size())] ^= char(1 << below(8));
      break;
    case 1:
      text.resize(below(text.size() + 1));
      break;
    case 2:
      text.insert(below(text.size() + 1), std::string(1, char(below(256))));
      break;
    case 3:
    case 4:
      return replaceNumber(text);
    case 5:
      text.erase(below(text.size() + 1), 1 + below(8));
      break;
    default: // a part again, elsewhere
      std::string part = text.substr(below(text.size() + 1), below(40));
      text.insert(below(text.size() + 1), part);
    }
  }

  /// Changes what a glTF file says and not how: a value becomes another one, of
  /// the file or of another type, a member goes, an element comes again.
  void mutateJson(std::string &text) {
    using Json = nlohmann::json;
    Json root = Json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (!root.is_object())
      return mutate(text);
    std::vector<Json *> values;
    collect(root, values);
    Json &value = *values[below(values.size())];
    switch (below(4)) {
    case 0: {
      const Json others[] = {nullptr,
                             true,
                             -1,
                             0,
                             1,
                             2,
                             255,
                             5120,
                             4294967295u,
                             1e300,
                             0.5,
                             "",
                             Json::array(),
                             Json::object(),
                             Json::array({0}),
                             Json::array({1, "a"})};
      value = others[below(std::size(others))];
      break;
    }
    case 1: {
      Json copy = *values[below(values.size())];
      value = std::move(copy);
      break;
    }
    case 2:
      if (value.is_structured() && !value.empty()) {
        auto at = value.begin();
        std::advance(at, below(value.size()));
        value.erase(at);
      }
      break;
    default:
      if (value.is_array() && !value.empty()) {
        Json copy = value[below(value.size())];
        value.push_back(std::move(copy));
      } else if (value.is_number_integer()) {
        value = value.get<int64_t>() + (below(2) ? 1 : -1);
      }
    }
    text = root.dump();
  }

private:
  static void collect(nlohmann::json &value,
                      std::vector<nlohmann::json *> &values) {
    values.push_back(&value);
    if (value.is_structured())
      for (auto &part : value)
        collect(part, values);
  }

  /// Puts an extreme in place of a number of a text.
  void replaceNumber(std::string &text) {
    constexpr const char *extremes[] = {"0",
                                        "-1",
                                        "1",
                                        "2",
                                        "3",
                                        "255",
                                        "65535",
                                        "2147483647",
                                        "4294967295",
                                        "4294967296",
                                        "9007199254740993",
                                        "18446744073709551615",
                                        "1e39",
                                        "-1e400",
                                        "nan",
                                        "5120",
                                        "5121",
                                        "5123",
                                        "5126",
                                        "0.5"};
    constexpr const char *digits = "0123456789";
    size_t first = text.find_first_of(digits, below(text.size() + 1));
    if (first == text.npos)
      return;
    size_t end = std::min(text.find_first_not_of(digits, first), text.size());
    text.replace(first, end - first, extremes[below(std::size(extremes))]);
  }

  std::mt19937_64 random;
};

Result<Mesh> readAs(Format format, const std::string &content) {
  // On the heap and as long as it is, so that no read after it goes unseen.
  std::vector<char> copy(content.begin(), content.end());
  std::string_view view(copy.data(), copy.size());
  switch (format) {
  case Format::Ply:
    return readPly(view);
  case Format::Obj:
    return readObj(view);
  case Format::Stl:
    return readStl(view);
  case Format::Gltf:
    break;
  }
  return readGltf(view, [](const std::string &) {
    return Result<std::string>(dataOfGltf());
  });
}

std::string checkMesh(const Mesh &mesh) {
  if (mesh.triangles.empty())
    return "a mesh without triangles";
  for (const auto &vertex : mesh.vertices)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(vertex.position[k]) ||
          !std::isfinite(vertex.normal[k]))
        return "a vertex that is not finite";
  for (const auto &triangle : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      if (triangle.vertex[k] < 0 ||
          size_t(triangle.vertex[k]) >= mesh.vertices.size())
        return "a triangle of a vertex that is not there";
  return "";
}

} // namespace

std::string fuzzReaders(uint64_t seed, uint64_t count) {
  std::vector<Seed> seeds;
  addPly(seeds);
  addTexts(seeds);
  addGltf(seeds);
  addDataUris(seeds);
  for (const Seed &whole : seeds)
    if (auto mesh = readAs(whole.format, whole.content); !mesh)
      return "of the corpus: " + mesh.error().message + "\n" + whole.content;
  for (uint64_t i = 0; i < count; ++i) {
    Mutator mutator(seed + i);
    Seed file = seeds[mutator.below(seeds.size())];
    bool isJson = file.content.starts_with('{') && mutator.below(2);
    for (size_t k = 1 + mutator.below(4); k > 0; --k)
      isJson ? mutator.mutateJson(file.content) : mutator.mutate(file.content);
    auto mesh = readAs(file.format, file.content);
    std::string problem = mesh ? checkMesh(*mesh)
                          : mesh.error().message.empty()
                              ? "an error without a message"
                              : "";
    if (!problem.empty())
      return "seed " + std::to_string(seed + i) + ": " + problem;
  }
  return "";
}
