//===- GltfCheck.cpp - Whether a glTF file can be read --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "GltfCheck.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <iterator>

using namespace piko;

namespace {

struct Unsupported {
  std::string_view extension, remedy;
};

constexpr Unsupported unsupported[] = {
    {"KHR_draco_mesh_compression", "cp"},
    {"EXT_meshopt_compression", "cp"},
    {"KHR_meshopt_compression", "cp"},
    {"KHR_mesh_quantization", "dequantize"},
};

/// Extensions that change only what a scene does not take from a file:
/// materials, textures, lights and motion.
constexpr std::string_view ignored[] = {
    "KHR_materials_", "KHR_texture_", "EXT_texture_",  "MSFT_texture_",
    "KHR_lights_",    "EXT_lights_",  "KHR_animation_"};

/// The JSON of a file, which in GLB is the first chunk.
std::string_view findJson(std::string_view content) {
  constexpr size_t chunk = 12, start = 20;
  if (!content.starts_with("glTF"))
    return content;
  if (content.size() < start)
    return {};
  uint32_t length = 0;
  for (size_t i = 0; i < 4; ++i)
    length |= uint32_t(uint8_t(content[chunk + i])) << (8 * i);
  return content.substr(start, length);
}

std::string describe(const std::string &extension) {
  std::string message = "it requires the glTF extension '" + extension +
                        "', which is not "
                        "supported";
  auto known =
      std::ranges::find(unsupported, extension, &Unsupported::extension);
  if (known == std::end(unsupported))
    return message;
  return message + ": convert it, as with 'gltf-transform " +
         std::string(known->remedy) + " in.glb out.glb'";
}

} // namespace

std::string render::checkGltf(std::string_view content) {
  auto file = nlohmann::json::parse(findJson(content), /*cb=*/nullptr,
                                    /*allow_exceptions=*/false);
  if (!file.is_object())
    return {};
  auto required = file.find("extensionsRequired");
  if (required == file.end() || !required->is_array())
    return {};
  for (const auto &extension : *required) {
    if (!extension.is_string())
      continue;
    auto name = extension.get<std::string>();
    if (!std::ranges::any_of(ignored, [&](std::string_view prefix) {
          return name.starts_with(prefix);
        }))
      return describe(name);
  }
  return {};
}
