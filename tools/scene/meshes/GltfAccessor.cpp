//===- GltfAccessor.cpp - The numbers of a glTF file ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Bytes.h"
#include "GltfFile.h"

#include <algorithm>
#include <iterator>

using namespace piko;
using namespace piko::render;

namespace {

/// Elements of an accessor without data, which cost the file nothing.
constexpr uint64_t zerosLimit = 1 << 20;

struct ComponentType {
  uint64_t code;
  unsigned size;
  double most; ///< what a normalized integer is divided by; 0 = a float
};

constexpr ComponentType componentTypes[] = {
    {5120, 1, 127},   {5121, 1, 255},        {5122, 2, 32767},
    {5123, 2, 65535}, {5125, 4, 4294967295}, {5126, 4, 0}};

const ComponentType *findType(uint64_t code) {
  auto found = std::ranges::find(componentTypes, code, &ComponentType::code);
  return found == std::end(componentTypes) ? nullptr : &*found;
}

double loadComponent(uint64_t type, const char *bytes) {
  switch (type) {
  case 5120:
    return loadBytes<int8_t>(bytes);
  case 5121:
    return loadBytes<uint8_t>(bytes);
  case 5122:
    return loadBytes<int16_t>(bytes);
  case 5123:
    return loadBytes<uint16_t>(bytes);
  case 5125:
    return loadBytes<uint32_t>(bytes);
  default:
    return loadBytes<float>(bytes);
  }
}

unsigned countComponents(const nlohmann::json &accessor) {
  auto type = accessor.find("type");
  if (type == accessor.end() || !type->is_string())
    return 0;
  const std::string &name = type->get_ref<const std::string &>();
  if (name == "SCALAR")
    return 1;
  return name == "VEC2" ? 2 : name == "VEC3" ? 3 : name == "VEC4" ? 4 : 0;
}

} // namespace

GltfFile::Accessor GltfFile::accessor(uint64_t index) {
  Accessor result;
  const Json *json = find("accessors", index);
  if (!json)
    return result;
  result.name = "accessors[" + std::to_string(index) + "]";
  result.count = number(*json, "count", 0);
  result.type = number(*json, "componentType", 0);
  result.components = countComponents(*json);
  if (auto found = json->find("normalized"); found != json->end())
    result.isNormalized = found->is_boolean() && found->get<bool>();
  if (!findType(result.type))
    fail(result.name + " has the unknown componentType " +
         std::to_string(result.type));
  else if (result.components == 0)
    fail(result.name + ": expected the type SCALAR, VEC2, VEC3 or VEC4");
  else if (result.count == 0)
    fail(result.name + " has no elements");
  else
    locate(result, *json);
  return result;
}

void GltfFile::locate(Accessor &result, const Json &from) {
  uint64_t source = 0, size = result.components * findType(result.type)->size;
  if (!index(from, "bufferView", source)) {
    if (result.count > zerosLimit)
      fail(result.name + ": expected a bufferView, or not more than " +
           std::to_string(zerosLimit) + " elements, but got " +
           std::to_string(result.count));
    return;
  }
  View data = view(source);
  uint64_t offset = number(from, "byteOffset", 0);
  result.stride = data.stride ? data.stride : size;
  if (!problem.empty())
    return;
  if (result.stride < size)
    return fail(result.name + " has elements of " + std::to_string(size) +
                " bytes, but bufferViews[" + std::to_string(source) +
                "] has a byteStride of " + std::to_string(result.stride));
  bool fits =
      liesWithin(offset, size, data.bytes.size()) &&
      result.count - 1 <= (data.bytes.size() - offset - size) / result.stride;
  if (!fits)
    return fail(result.name + ": " + std::to_string(result.count) +
                " elements from byte " + std::to_string(offset) +
                " on are not within the " + std::to_string(data.bytes.size()) +
                " bytes of bufferViews[" + std::to_string(source) + "]");
  result.bytes =
      data.bytes.substr(offset, (result.count - 1) * result.stride + size);
}

std::vector<double> GltfFile::readValues(const Accessor &from) {
  if (!problem.empty())
    return {};
  std::vector<double> values(from.count * from.components);
  if (from.bytes.empty())
    return values;
  const ComponentType &type = *findType(from.type);
  for (uint64_t i = 0; i < from.count; ++i)
    for (unsigned k = 0; k < from.components; ++k) {
      double value =
          loadComponent(from.type, from.bytes.data() + i * from.stride +
                                       size_t(k) * type.size);
      if (from.isNormalized && type.most > 0)
        value = std::max(value / type.most, -1.0);
      values[i * from.components + k] = value;
    }
  return values;
}

void GltfFile::replaceSparse(const Json &sparse, const Accessor &base,
                             std::vector<double> &values) {
  auto indices = sparse.find("indices"), others = sparse.find("values");
  if (indices == sparse.end() || !indices->is_object() ||
      others == sparse.end() || !others->is_object())
    return fail(base.name + " has a 'sparse' without indices and values");
  Accessor places;
  places.name = base.name + ".sparse.indices";
  places.count = number(sparse, "count", 0);
  places.type = number(*indices, "componentType", 0);
  places.components = 1;
  Accessor news = base;
  news.name = base.name + ".sparse.values";
  news.count = places.count;
  news.bytes = {};
  if (places.count == 0 || places.count > base.count ||
      (places.type != 5121 && places.type != 5123 && places.type != 5125))
    return fail(places.name + " cannot be: " + std::to_string(places.count) +
                " of the componentType " + std::to_string(places.type));
  if (!indices->contains("bufferView") || !others->contains("bufferView"))
    return fail(base.name + " has a 'sparse' without bufferViews");
  locate(places, *indices);
  locate(news, *others);
  std::vector<double> at = readValues(places), value = readValues(news);
  for (size_t i = 0; i < at.size() && problem.empty(); ++i) {
    if (at[i] >= double(base.count) || (i > 0 && at[i] <= at[i - 1]))
      return fail(places.name + ": expected rising indices below " +
                  std::to_string(base.count) + ", but got " +
                  std::to_string(uint64_t(at[i])));
    for (unsigned k = 0; k < base.components; ++k)
      values[size_t(at[i]) * base.components + k] =
          value[i * base.components + k];
  }
}

std::vector<float> GltfFile::readFloats(uint64_t index, unsigned components) {
  Accessor from = accessor(index);
  if (problem.empty() && from.components != components)
    fail(from.name + ": expected " + std::to_string(components) +
         " components, but got " + std::to_string(from.components));
  std::vector<double> values = readValues(from);
  if (const Json *json = find("accessors", index))
    if (auto sparse = json->find("sparse"); sparse != json->end()) {
      if (sparse->is_object())
        replaceSparse(*sparse, from, values);
      else
        fail(from.name + " has a 'sparse' that is no object");
    }
  if (!problem.empty())
    return {};
  return {values.begin(), values.end()};
}

std::vector<uint32_t> GltfFile::readIndices(uint64_t index, uint64_t limit) {
  Accessor from = accessor(index);
  if (problem.empty() &&
      (from.components != 1 || from.isNormalized ||
       (from.type != 5121 && from.type != 5123 && from.type != 5125)))
    fail(from.name + ": expected unsigned integers as indices");
  std::vector<double> values = readValues(from);
  if (const Json *json = find("accessors", index))
    if (auto sparse = json->find("sparse");
        sparse != json->end() && sparse->is_object())
      replaceSparse(*sparse, from, values);
  for (double value : values)
    if (value >= double(limit)) {
      fail(from.name + " names vertex " + std::to_string(uint64_t(value)) +
           " of " + std::to_string(limit));
      break;
    }
  if (!problem.empty())
    return {};
  return {values.begin(), values.end()};
}
