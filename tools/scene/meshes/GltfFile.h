//===- GltfFile.h - The document and the data of a glTF file ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_GLTFFILE_H
#define PIKO_TOOLS_SCENE_GLTFFILE_H

#include "MeshReaders.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace piko::render {

/// A glTF document, with the buffers that were asked for. What goes wrong first
/// is kept in `problem`; everything after it returns nothing.
class GltfFile {
public:
  using Json = nlohmann::json;

  /// Reads the JSON of a .gltf or .glb file.
  GltfFile(std::string_view content, const OpenFile &open);

  /// The object at a place of one of the document's arrays, as "nodes"; null
  /// and a problem if there is none.
  const Json *find(const char *array, uint64_t index);
  /// How long one of the document's arrays is.
  uint64_t count(const char *array) const;

  /// A whole number in an object; `otherwise` if there is none of the name.
  uint64_t number(const Json &object, const char *name, uint64_t otherwise);
  /// Whether an object names an index, which goes to `index`.
  bool index(const Json &object, const char *name, uint64_t &index);
  /// Numbers in an array of an object; `values` stays as it is if there is
  /// none.
  void numbers(const Json &object, const char *name, double *values,
               size_t count);
  /// The extension of an object; null if it has none of the name.
  static const Json *extension(const Json &object, const char *name);

  /// The values of an accessor, `components` to an element; integers as they
  /// are, or from -1 to 1 where they are normalized.
  std::vector<float> readFloats(uint64_t accessor, unsigned components);
  /// The values of an accessor of vertices' indices, all below `limit`.
  std::vector<uint32_t> readIndices(uint64_t accessor, uint64_t limit);

  void fail(const std::string &message);

  Json root;
  std::vector<std::string> warnings;
  std::string problem;

private:
  struct View {
    std::string_view bytes;
    uint64_t stride = 0; ///< 0 = elements are dense
  };
  struct Accessor {
    std::string name;
    uint64_t count = 0, type = 0;
    unsigned components = 0;
    bool isNormalized = false;
    std::string_view bytes; ///< of all elements; empty if all are 0
    uint64_t stride = 0;
  };
  std::string_view splitGlb(std::string_view content);
  std::string_view buffer(uint64_t index);
  View view(uint64_t index);
  Accessor accessor(uint64_t index);
  /// Data of an accessor, or of the values in place of others.
  void locate(Accessor &result, const Json &from);
  std::vector<double> readValues(const Accessor &from);
  void replaceSparse(const Json &sparse, const Accessor &base,
                     std::vector<double> &values);

  const OpenFile &open;
  std::optional<std::string_view> binary; ///< the BIN chunk
  std::map<uint64_t, std::string> buffers;
};

/// The bytes of a data URI. The error says what is wrong with it.
Result<std::string> decodeDataUri(std::string_view uri);

/// A text with its percent codes decoded.
std::string decodePercents(std::string_view text);

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_GLTFFILE_H
