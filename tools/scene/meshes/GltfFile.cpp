//===- GltfFile.cpp - The document and the buffers of a glTF file ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "GltfFile.h"

#include "Bytes.h"

#include <cmath>

using namespace piko;
using namespace piko::render;

namespace {

constexpr size_t glbHeader = 12, chunkHeader = 8;
constexpr uint32_t jsonChunk = 0x4e4f534a, binChunk = 0x004e4942;

std::string placeOf(const char *array, uint64_t index) {
  return std::string(array) + "[" + std::to_string(index) + "]";
}

} // namespace

GltfFile::GltfFile(std::string_view content, const OpenFile &open)
    : open(open) {
  if (content.starts_with("glTF"))
    content = splitGlb(content);
  else if (isUtf16(content))
    fail("it is a text in UTF-16: save it as UTF-8");
  if (!problem.empty())
    return;
  if (content.starts_with(byteOrderMark))
    content.remove_prefix(byteOrderMark.size());
  root = Json::parse(content, /*cb=*/nullptr, /*allow_exceptions=*/false);
  if (!root.is_object()) {
    fail("its JSON is broken, or no object");
    return;
  }
  auto asset = root.find("asset");
  auto getVersion = [&](const char *name) {
    if (asset != root.end() && asset->is_object())
      if (auto found = asset->find(name);
          found != asset->end() && found->is_string())
        return found->get<std::string>();
    return std::string();
  };
  if (std::string version = getVersion("version"); !version.starts_with("2."))
    fail("expected glTF 2, but its 'asset' has the version " +
         quoteWord(version));
  // A later one may say that a reader of this one has enough.
  if (std::string least = getVersion("minVersion");
      !least.empty() && least != "2.0")
    fail("it needs a reader of glTF " + quoteWord(least) +
         ", but this one is of 2.0");
}

/// The JSON of a GLB file; keeps the binary chunk.
std::string_view GltfFile::splitGlb(std::string_view content) {
  if (content.size() < glbHeader + chunkHeader) {
    fail("it is cut short: it has no chunk");
    return {};
  }
  uint32_t version = loadBytes<uint32_t>(content.data() + 4);
  uint32_t length = loadBytes<uint32_t>(content.data() + 8);
  if (version != 2)
    fail("expected version 2 of GLB, but got " + std::to_string(version));
  if (length > content.size())
    fail("it is cut short: expected " + std::to_string(length) +
         " bytes, but got " + std::to_string(content.size()));
  else if (length < content.size())
    warnings.push_back(std::to_string(content.size() - length) +
                       " bytes behind its end are ignored");
  if (!problem.empty())
    return {};
  std::string_view rest = content.substr(0, length), json;
  rest.remove_prefix(std::min(glbHeader, rest.size()));
  for (int i = 0; rest.size() >= chunkHeader; ++i) {
    uint32_t size = loadBytes<uint32_t>(rest.data());
    uint32_t type = loadBytes<uint32_t>(rest.data() + 4);
    rest.remove_prefix(chunkHeader);
    if (size > rest.size())
      fail("it is cut short: chunk " + std::to_string(i) + " has " +
           std::to_string(size) + " bytes, but " + std::to_string(rest.size()) +
           " are left");
    if (i == 0 && type != jsonChunk)
      fail("expected JSON in its first chunk");
    if (!problem.empty())
      return {};
    std::string_view data = rest.substr(0, size);
    if (i == 0)
      json = data;
    else if (type == binChunk && !binary)
      binary = data;
    rest.remove_prefix(size);
  }
  return json;
}

void GltfFile::fail(const std::string &message) {
  if (problem.empty())
    problem = message;
}

uint64_t GltfFile::count(const char *array) const {
  auto found = root.find(array);
  return found != root.end() && found->is_array() ? found->size() : 0;
}

const GltfFile::Json *GltfFile::find(const char *array, uint64_t index) {
  if (!problem.empty())
    return nullptr;
  if (index >= count(array)) {
    fail("expected " + placeOf(array, index) + ", but there are " +
         std::to_string(count(array)));
    return nullptr;
  }
  const Json &object = root[array][index];
  if (object.is_object())
    return &object;
  fail(placeOf(array, index) + " is no object");
  return nullptr;
}

uint64_t GltfFile::number(const Json &object, const char *name,
                          uint64_t otherwise) {
  auto found = object.find(name);
  if (found == object.end())
    return otherwise;
  constexpr double most = 9007199254740992; // 2^53
  if (found->is_number()) {
    double value = found->get<double>();
    if (value >= 0 && value <= most && value == std::floor(value))
      return uint64_t(value);
  }
  fail(std::string("expected a whole number as '") + name + "', but got " +
       quoteWord(found->dump(-1, ' ', false, Json::error_handler_t::replace)));
  return otherwise;
}

bool GltfFile::index(const Json &object, const char *name, uint64_t &index) {
  if (!object.contains(name))
    return false;
  index = number(object, name, 0);
  return problem.empty();
}

void GltfFile::numbers(const Json &object, const char *name, double *values,
                       size_t count) {
  auto found = object.find(name);
  if (found == object.end())
    return;
  if (!found->is_array() || found->size() != count)
    return fail(std::string("expected ") + std::to_string(count) +
                " numbers as '" + name + "'");
  for (size_t i = 0; i < count; ++i) {
    if (!(*found)[i].is_number())
      return fail(std::string("expected numbers as '") + name + "'");
    values[i] = (*found)[i].get<double>();
  }
}

const GltfFile::Json *GltfFile::extension(const Json &object,
                                          const char *name) {
  auto all = object.find("extensions");
  if (all == object.end() || !all->is_object())
    return nullptr;
  auto found = all->find(name);
  return found != all->end() && found->is_object() ? &*found : nullptr;
}

std::string_view GltfFile::buffer(uint64_t index) {
  const Json *json = find("buffers", index);
  if (!json)
    return {};
  uint64_t length = number(*json, "byteLength", 0);
  std::string_view bytes;
  auto uri = json->find("uri");
  if (auto known = buffers.find(index); known != buffers.end()) {
    bytes = known->second;
  } else if (uri == json->end()) {
    if (index != 0 || !binary)
      fail(placeOf("buffers", index) + " has no data");
    bytes = binary.value_or(std::string_view());
  } else if (!uri->is_string()) {
    fail(placeOf("buffers", index) + " has a 'uri' that is no text");
  } else {
    const std::string &name = uri->get_ref<const std::string &>();
    Result<std::string> content =
        name.starts_with("data:") ? decodeDataUri(name)
        : name.find("://") != name.npos
            ? Result<std::string>(Error{"expected a file beside it, but got " +
                                        quoteWord(name)})
            : open(name);
    if (!content)
      fail(placeOf("buffers", index) + ": " + content.error().message);
    else
      bytes = buffers[index] = std::move(*content);
  }
  if (problem.empty() && bytes.size() < length)
    fail(placeOf("buffers", index) + ": expected " + std::to_string(length) +
         " bytes, but got " + std::to_string(bytes.size()));
  return problem.empty() ? bytes.substr(0, length) : std::string_view();
}

GltfFile::View GltfFile::view(uint64_t index) {
  const Json *json = find("bufferViews", index);
  uint64_t source = 0;
  View result;
  if (!json)
    return result;
  std::string name = placeOf("bufferViews", index);
  if (!this->index(*json, "buffer", source)) {
    fail(name + " has no buffer");
    return result;
  }
  uint64_t offset = number(*json, "byteOffset", 0);
  uint64_t length = number(*json, "byteLength", 0);
  result.stride = number(*json, "byteStride", 0);
  if (json->contains("byteStride") &&
      (result.stride < 4 || result.stride > 252 || result.stride % 4 != 0))
    fail(name + ": expected a 'byteStride' from 4 to 252 in fours, but got " +
         std::to_string(result.stride));
  std::string_view bytes = buffer(source);
  if (problem.empty() && !liesWithin(offset, length, bytes.size()))
    fail(name + ": bytes " + std::to_string(offset) + " to " +
         std::to_string(offset + length) + " are not within the " +
         std::to_string(bytes.size()) + " of " + placeOf("buffers", source));
  if (problem.empty())
    result.bytes = bytes.substr(offset, length);
  return result;
}
