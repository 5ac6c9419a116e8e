//===- GltfReader.cpp - Reads the triangles of glTF files -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "GltfFile.h"
#include "GltfTransform.h"
#include "MeshBuilder.h"

#include <algorithm>
#include <iterator>

using namespace piko;
using namespace piko::render;

namespace {

using Json = nlohmann::json;

constexpr std::string_view supported[] = {
    "EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "KHR_node_visibility"};

/// Extensions that change only what a scene does not take from a file:
/// materials, textures, lights and motion.
constexpr std::string_view ignored[] = {
    "KHR_materials_", "KHR_texture_",    "EXT_texture_",     "MSFT_texture_",
    "KHR_lights_",    "EXT_lights_",     "KHR_animation_",   "KHR_xmp",
    "KHR_audio",      "KHR_techniques_", "ADOBE_materials_", "MSFT_packing_"};

constexpr std::string_view compressions[] = {"KHR_draco_mesh_compression",
                                             "EXT_meshopt_compression",
                                             "KHR_meshopt_compression"};

bool isAmong(std::string_view name, std::span<const std::string_view> list) {
  return std::ranges::count(list, name) > 0;
}

bool isHarmless(std::string_view name) {
  return isAmong(name, supported) ||
         std::ranges::any_of(ignored, [&](std::string_view prefix) {
           return name.starts_with(prefix);
         });
}

class GltfReader {
public:
  GltfReader(std::string_view content, const OpenFile &open)
      : file(content, open) {}

  Result<Mesh> read() {
    if (file.problem.empty())
      checkExtensions();
    if (file.problem.empty())
      addScene();
    if (!file.problem.empty())
      return Error{file.problem};
    for (const std::string &warning : file.warnings)
      builder.warn(warning);
    return builder.finish();
  }

private:
  struct Placed {
    uint64_t node;
    Transform parent;
  };
  /// The corners of a primitive, three for each triangle.
  struct Primitive {
    std::vector<float> positions, normals;
    std::vector<uint32_t> corners;
    bool toJoin = false;
  };

  std::vector<std::string> names(const char *list) {
    std::vector<std::string> result;
    auto found = file.root.find(list);
    if (found != file.root.end() && found->is_array())
      for (const Json &name : *found)
        if (name.is_string())
          result.push_back(name.get<std::string>());
    return result;
  }

  void checkExtensions() {
    for (const std::string &name : names("extensionsRequired")) {
      if (isHarmless(name))
        continue;
      std::string remedy =
          isAmong(name, compressions)
              ? ": convert it, as with 'gltf-transform cp in.glb out.glb'"
              : "";
      return file.fail("it requires the glTF extension '" + name +
                       "', which is not supported" + remedy);
    }
    for (const std::string &name : names("extensionsUsed")) {
      isQuantized |= name == "KHR_mesh_quantization";
      // What is compressed, but not required to be, is there twice.
      if (!isHarmless(name) && !isAmong(name, compressions))
        builder.warn("the glTF extension '" + name +
                     "' is not supported, and left out");
    }
    for (const std::string &name : names("extensionsRequired"))
      isQuantized |= name == "KHR_mesh_quantization";
  }

  /// The nodes that a scene names, or those that are no child of others.
  std::vector<uint64_t> findRoots() {
    uint64_t scene = file.number(file.root, "scene", 0);
    if (file.count("scenes") > 0 || file.root.contains("scene")) {
      const Json *found = file.find("scenes", scene);
      return found ? list(*found, "nodes") : std::vector<uint64_t>();
    }
    std::vector<bool> isChild(file.count("nodes"));
    for (uint64_t i = 0; i < isChild.size(); ++i)
      if (const Json *node = file.find("nodes", i))
        for (uint64_t child : list(*node, "children"))
          if (child < isChild.size())
            isChild[child] = true;
    std::vector<uint64_t> roots;
    for (uint64_t i = 0; i < isChild.size(); ++i)
      if (!isChild[i])
        roots.push_back(i);
    return roots;
  }

  std::vector<uint64_t> list(const Json &object, const char *name) {
    std::vector<uint64_t> result;
    auto found = object.find(name);
    if (found == object.end())
      return result;
    if (!found->is_array())
      file.fail(std::string("'") + name + "' is no array");
    else
      for (const Json &item : *found) {
        if (!item.is_number_unsigned())
          file.fail(std::string("expected indices as '") + name + "'");
        else
          result.push_back(item.get<uint64_t>());
      }
    return result;
  }

  /// Visits nodes in front of their children, and these in their order.
  void addScene() {
    std::vector<bool> isVisited(file.count("nodes"));
    std::vector<Placed> pending;
    auto push = [&](const std::vector<uint64_t> &nodes, const Transform &at) {
      for (auto i = nodes.rbegin(); i != nodes.rend(); ++i)
        pending.push_back({*i, at});
    };
    push(findRoots(), Transform());
    while (!pending.empty() && !failed()) {
      auto [index, parent] = pending.back();
      pending.pop_back();
      const Json *node = file.find("nodes", index);
      if (!node)
        return;
      if (isVisited[index])
        return file.fail("nodes[" + std::to_string(index) +
                         "] has two parents, or is its own descendant");
      isVisited[index] = true;
      if (isHidden(*node))
        continue;
      Transform toWorld = parent * readTransform(file, *node);
      addInstances(*node, index, toWorld);
      push(list(*node, "children"), toWorld);
    }
  }

  bool failed() const { return !file.problem.empty() || builder.hasFailed(); }

  static bool isHidden(const Json &node) {
    const Json *found = GltfFile::extension(node, "KHR_node_visibility");
    if (!found)
      return false;
    auto visible = found->find("visible");
    return visible != found->end() && visible->is_boolean() &&
           !visible->get<bool>();
  }

  void addInstances(const Json &node, uint64_t index,
                    const Transform &toWorld) {
    uint64_t number = 0;
    if (!file.index(node, "mesh", number))
      return;
    if (node.contains("skin"))
      builder.warn("nodes[" + std::to_string(index) +
                   "]: its skin is left out, and its mesh drawn at rest");
    std::vector<Transform> places{toWorld};
    if (const Json *instancing =
            GltfFile::extension(node, "EXT_mesh_gpu_instancing")) {
      places = readInstances(file, *instancing);
      for (Transform &place : places)
        place = toWorld * place;
    }
    const Json *mesh = file.find("meshes", number);
    if (!mesh || failed())
      return;
    std::string name = "meshes[" + std::to_string(number) + "]";
    auto primitives = mesh->find("primitives");
    if (primitives == mesh->end() || !primitives->is_array())
      return file.fail(name + " has no primitives");
    for (size_t i = 0; i < primitives->size() && !failed(); ++i) {
      Primitive primitive;
      std::string place = name + ".primitives[" + std::to_string(i) + "]";
      if (!(*primitives)[i].is_object())
        return file.fail(place + " is no object");
      if (!readPrimitive((*primitives)[i], place, primitive))
        continue;
      morph((*primitives)[i], node.contains("weights") ? node : *mesh, place,
            primitive);
      for (const Transform &at : places)
        if (!failed())
          addPrimitive(primitive, at);
    }
  }

  bool readPrimitive(const Json &json, const std::string &place,
                     Primitive &result) {
    uint64_t mode = file.number(json, "mode", 4), position = 0, other = 0;
    if (mode < 4) {
      builder.warn("its points and lines are left out");
      return false;
    }
    if (mode > 6) {
      file.fail(place + " has the unknown mode " + std::to_string(mode));
      return false;
    }
    auto attributes = json.find("attributes");
    if (attributes == json.end() || !attributes->is_object()) {
      file.fail(place + " has no attributes");
      return false;
    }
    if (!file.index(*attributes, "POSITION", position)) {
      builder.warn(place + " has no positions, and is left out");
      return false;
    }
    result.positions = readVectors(position, true);
    size_t count = result.positions.size() / 3;
    if (file.index(*attributes, "NORMAL", other)) {
      result.normals = readVectors(other, false);
      if (!failed() && result.normals.size() != result.positions.size())
        file.fail(place + " has " + std::to_string(count) + " positions, but " +
                  std::to_string(result.normals.size() / 3) + " normals");
    }
    std::vector<uint32_t> indices;
    if (file.index(json, "indices", other)) {
      indices = file.readIndices(other, count);
    } else {
      for (size_t i = 0; i < count; ++i)
        indices.push_back(uint32_t(i));
    }
    if (mode == 4 && indices.size() % 3 != 0)
      builder.warn(place + " has " + std::to_string(indices.size() % 3) +
                   " vertices after its last triangle");
    split(mode, indices, result.corners);
    result.toJoin = !isShared(result.corners, count);
    return !failed();
  }

  /// Positions or normals: floats, or, as the extension for quantized meshes
  /// allows, integers.
  std::vector<float> readVectors(uint64_t index, bool arePositions) {
    const Json *accessor = file.find("accessors", index);
    if (!accessor)
      return {};
    uint64_t type = file.number(*accessor, "componentType", 0);
    bool isInteger = type >= 5120 && type <= 5123;
    auto normalized = accessor->find("normalized");
    bool isNormalized =
        normalized != accessor->end() && *normalized == Json(true);
    bool isAllowed = type == 5126 || (isQuantized && isInteger &&
                                      (arePositions || isNormalized));
    if (!isAllowed)
      file.fail("accessors[" + std::to_string(index) +
                "]: expected floats, or, with KHR_mesh_quantization, "
                "integers, but got the componentType " +
                std::to_string(type));
    return file.readFloats(index, 3);
  }

  static void split(uint64_t mode, const std::vector<uint32_t> &indices,
                    std::vector<uint32_t> &corners) {
    size_t n = indices.size();
    size_t step = mode == 4 ? 3 : 1;
    for (size_t i = 0; n - i >= 3 && i < n; i += step) {
      bool isTurned = mode == 5 && i % 2 == 1;
      size_t a = mode == 6 ? 0 : i, b = i + 1;
      if (isTurned)
        std::swap(a, b);
      corners.insert(corners.end(), {indices[a], indices[b], indices[i + 2]});
    }
  }

  static bool isShared(const std::vector<uint32_t> &corners, size_t count) {
    std::vector<bool> isUsed(count);
    for (uint32_t corner : corners) {
      if (isUsed[corner])
        return true;
      isUsed[corner] = true;
    }
    return false;
  }

  /// Adds the morph targets of a primitive by the weights of a node or mesh.
  void morph(const Json &json, const Json &weighted, const std::string &place,
             Primitive &primitive) {
    auto targets = json.find("targets"), weights = weighted.find("weights");
    if (targets == json.end() || weights == weighted.end() || failed())
      return;
    if (!targets->is_array() || !weights->is_array() ||
        weights->size() != targets->size())
      return file.fail(place + ": expected a weight for each morph target");
    for (size_t i = 0; i < weights->size() && !failed(); ++i) {
      const Json &target = (*targets)[i];
      if (!(*weights)[i].is_number() || !target.is_object())
        return file.fail(place + ": expected morph targets and numbers");
      float weight = float((*weights)[i].get<double>());
      if (weight == 0)
        continue;
      addTarget(target, "POSITION", weight, place, primitive.positions);
      if (!primitive.normals.empty())
        addTarget(target, "NORMAL", weight, place, primitive.normals);
    }
  }

  void addTarget(const Json &target, const char *name, float weight,
                 const std::string &place, std::vector<float> &values) {
    uint64_t index = 0;
    if (!file.index(target, name, index))
      return;
    std::vector<float> moved = readVectors(index, *name == 'P');
    if (!failed() && moved.size() != values.size())
      return file.fail(place + " has a morph target of another length");
    for (size_t i = 0; i < moved.size(); ++i)
      values[i] += weight * moved[i];
  }

  void addPrimitive(const Primitive &from, const Transform &toWorld) {
    auto vector = [](const std::vector<float> &values, uint32_t i) {
      return glm::dvec3(values[size_t(i) * 3], values[size_t(i) * 3 + 1],
                        values[size_t(i) * 3 + 2]);
    };
    std::vector<int32_t> places(from.positions.size() / 3, -1);
    glm::dmat3 normalToWorld = toWorld.normalToWorld();
    auto place = [&](uint32_t i) {
      if (places[i] >= 0)
        return places[i];
      glm::vec3 normal(0);
      if (!from.normals.empty())
        normal = normalizeOr(glm::vec3(normalToWorld * vector(from.normals, i)),
                             {0, 0, 1});
      return places[i] = builder.addVertex(
                 toWorld.apply(vector(from.positions, i)), normal, from.toJoin);
    };
    bool isMirrored = toWorld.isMirrored();
    for (size_t i = 0; i < from.corners.size() && !failed(); i += 3) {
      glm::ivec3 corners;
      for (int k = 0; k < 3; ++k)
        corners[k] = place(from.corners[i + size_t(k)]);
      if (isMirrored)
        std::swap(corners.y, corners.z);
      builder.addTriangle(corners);
    }
  }

  GltfFile file;
  bool isQuantized = false;
  MeshBuilder builder;
};

} // namespace

Result<Mesh> render::readGltf(std::string_view content, const OpenFile &open) {
  return GltfReader(content, open).read();
}
