//===- Binding.cpp - A scene into a pipeline that is not known ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/Binding.h"

#include <algorithm>
#include <charconv>
#include <cstring>

using namespace piko;
using namespace piko::render;

namespace {

/// What a scene has for one type.
struct Supply {
  void *data;
  int64_t count, size;
};

/// Binds one pipeline.
class Binder {
public:
  Binder(pikort_pipeline *pipeline, SceneInput &scene)
      : pipeline(pipeline), scene(scene) {}

  Result<std::string> bind() {
    return scene.capture ? bindCapture() : bindTypes();
  }

private:
  Result<std::string> bindCapture() {
    if (std::string wrong = scene.capture->bind(pipeline); !wrong.empty())
      return fail(wrong);
    if (auto ok = setConstants(); !ok)
      return ok.error();
    int images = 0;
    for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
      pikort_state_info state;
      if (pikort_get_state_info(pipeline, i, &state) != PIKORT_OK)
        return lastError();
      auto record = recordOf(state.record);
      if (!record)
        return record.error();
      if (state.kind == PIKORT_IMAGE && state.rank == 2 &&
          isColor(record->name)) {
        output = state.name;
        ++images;
      }
    }
    return images == 1 ? output : std::string();
  }

  Result<std::string> bindTypes() {
    for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
      pikort_state_info state;
      if (pikort_get_state_info(pipeline, i, &state) != PIKORT_OK)
        return lastError();
      if (auto ok = bindState(state); !ok)
        return ok.error();
    }
    for (int32_t i = 0; i < pikort_source_count(pipeline); ++i)
      if (auto ok = bindSource(i); !ok)
        return ok.error();
    if (scene.table && fed < 0)
      return fail("expected a source for table '" + scene.table->path +
                  "' whose primitives no scene has, but it has none");
    if (auto ok = setConstants(); !ok)
      return ok.error();
    if (output.empty())
      return fail("expected an image of 'piko::scene::Color' or "
                  "'piko::scene::Color8' for the result, but it has none");
    return output;
  }

  Result<Done> setConstants() {
    for (const auto &[name, value] : scene.values)
      if (auto ok = setConstant(name, value); !ok)
        return ok;
    return Done{};
  }

  static bool isColor(const char *type) {
    return !std::strcmp(type, "piko::scene::Color") ||
           !std::strcmp(type, "piko::scene::Color8");
  }

  Error fail(const std::string &message) const {
    return {"pipeline '" + std::string(pikort_name(pipeline)) +
            "': " + message};
  }
  Error lastError() const { return fail(pikort_message(pipeline)); }

  static std::string unsuitable(const std::string &what,
                                const std::string &type,
                                const std::string &expected) {
    return what + ": expected " + expected + ", but got '" + type + "'";
  }

  Result<pikort_record_info> recordOf(int32_t index) {
    pikort_record_info record;
    if (pikort_get_record(pipeline, index, &record) != PIKORT_OK)
      return lastError();
    return record;
  }

  /// "stage 'draw' of 'Lamp'".
  std::string describeSource(int32_t index) {
    pikort_source_info source;
    pikort_stage_info stage;
    pikort_record_info record;
    if (pikort_get_source_info(pipeline, index, &source) != PIKORT_OK ||
        pikort_get_stage_info(pipeline, source.stage, &stage) != PIKORT_OK ||
        pikort_get_record(pipeline, source.record, &record) != PIKORT_OK)
      return "source " + std::to_string(index);
    return "stage '" + std::string(stage.name) + "' of '" + record.name + "'";
  }

  /// Makes what is made only for pipelines that ask for this type. The error is
  /// a scene that has nothing of it.
  Result<Done> prepare(const char *type) {
    if (!std::strcmp(type, "piko::scene::Pixel") && scene.pixels.empty())
      for (int y = 0; y < scene.size.y; ++y)
        for (int x = 0; x < scene.size.x; ++x)
          scene.pixels.push_back({{x, y}});
    bool isOfTree = !std::strcmp(type, "piko::scene::BvhNode") ||
                    !std::strcmp(type, "piko::scene::BvhTriangle") ||
                    !std::strcmp(type, "piko::scene::Bounds");
    bool isOfMesh = isOfTree || !std::strcmp(type, "piko::scene::Vertex") ||
                    !std::strcmp(type, "piko::scene::Triangle");
    bool isOfPatches = !std::strcmp(type, "piko::scene::Patch");
    bool isOfView = !std::strcmp(type, "piko::scene::Camera") ||
                    !std::strcmp(type, "piko::scene::Light");
    if (scene.table && (isOfMesh || isOfPatches || isOfView))
      return fail("'" + std::string(type) + "': expected a scene, but '" +
                  scene.table->path + "' is a table");
    bool hasPatches = !scene.mesh.patches.empty();
    if (isOfMesh && hasPatches)
      return fail("'" + std::string(type) +
                  "': expected a scene of triangles, but it has patches");
    if (isOfPatches && !hasPatches)
      return fail("'" + std::string(type) +
                  "': expected a scene of patches, but it has triangles");
    if (isOfTree && !scene.bvh) {
      auto bvh = buildBvh(scene.mesh);
      if (!bvh)
        return bvh.error();
      scene.bvh = std::move(*bvh);
    }
    return Done{};
  }

  template <class T> static Supply supply(std::vector<T> &list) {
    return {list.data(), int64_t(list.size()), sizeof(T)};
  }

  /// What a scene has for a type; of size 0 if nothing.
  Supply constantFor(const char *type) {
    if (!std::strcmp(type, "piko::scene::Camera"))
      return {&scene.camera, 1, sizeof(scene::Camera)};
    if (!std::strcmp(type, "piko::scene::Settings"))
      return {&scene.settings, 1, sizeof(scene::Settings)};
    if (!std::strcmp(type, "piko::scene::Bounds"))
      return {&scene.bvh->bounds, 1, sizeof(scene::Bounds)};
    return {};
  }
  Supply meshFor(const char *type) {
    if (!std::strcmp(type, "piko::scene::Vertex"))
      return supply(scene.mesh.vertices);
    if (!std::strcmp(type, "piko::scene::Triangle"))
      return supply(scene.mesh.triangles);
    if (!std::strcmp(type, "piko::scene::Patch"))
      return supply(scene.mesh.patches);
    return {};
  }
  Supply bufferFor(const char *type) {
    if (!std::strcmp(type, "piko::scene::Light"))
      return supply(scene.lights);
    if (!std::strcmp(type, "piko::scene::BvhNode"))
      return supply(scene.bvh->nodes);
    if (!std::strcmp(type, "piko::scene::BvhTriangle"))
      return supply(scene.bvh->triangles);
    return meshFor(type);
  }
  Supply sourceFor(const char *type) {
    if (!std::strcmp(type, "piko::scene::Pixel"))
      return supply(scene.pixels);
    if (!std::strcmp(type, "piko::scene::Nothing"))
      return {nullptr, 0, sizeof(scene::Nothing)};
    return meshFor(type);
  }

  /// The table's lines, for a source of a type that no scene has.
  Result<Supply> supplyTable(int32_t source, int32_t record,
                             const std::string &type) {
    if (fed >= 0)
      return fail("expected one source for table '" + scene.table->path +
                  "', but " + describeSource(fed) + " and " +
                  describeSource(source) +
                  " take what no scene has; let an application feed both, and "
                  "render its capture");
    fed = source;
    auto known = scene.records.find(type);
    if (known == scene.records.end()) {
      auto records = makeRecords(*scene.table, pipeline, record);
      if (!records)
        return fail(records.error().message);
      known = scene.records.emplace(type, std::move(*records)).first;
    }
    TableRecords &records = known->second;
    return Supply{records.memory.data(), records.count, records.size};
  }

  Result<Done> bindState(const pikort_state_info &state) {
    auto record = recordOf(state.record);
    if (!record)
      return record.error();
    if (auto ok = prepare(record->name); !ok)
      return ok.error();
    if (state.kind == PIKORT_IMAGE)
      return noteImage(state, *record);
    if (state.kind == PIKORT_CONSTANT)
      return bindConstant(state, *record);
    if (state.per_source >= 0)
      return Done{};
    Supply supply = bufferFor(record->name);
    if (!supply.size)
      return fail(unsuitable("buffer '" + std::string(state.name) + "'",
                             record->name,
                             "elements of 'piko::scene::Light', "
                             "'...::Vertex', '...::Triangle', '...::Patch', "
                             "'...::BvhNode' or '...::BvhTriangle'"));
    if (pikort_bind_buffer(pipeline, state.name, supply.data, supply.count,
                           supply.size) != PIKORT_OK)
      return lastError();
    return Done{};
  }

  bool isSet(const std::string &constant) const {
    return std::any_of(scene.values.begin(), scene.values.end(),
                       [&](const auto &set) { return set.first == constant; });
  }

  Result<Done> bindConstant(const pikort_state_info &state,
                            const pikort_record_info &record) {
    Supply supply = constantFor(record.name);
    if (!supply.size && state.bound) // it has a value of its own
      return Done{};
    if (!supply.size && isSet(state.name))
      return Done{}; // by setConstants
    if (!supply.size)
      return fail(unsuitable("constant '" + std::string(state.name) + "'",
                             record.name,
                             "'piko::scene::Camera', '...::Settings', "
                             "'...::Bounds', a default value or --set"));
    if (pikort_bind_constant(pipeline, state.name, supply.data, supply.size) !=
        PIKORT_OK)
      return lastError();
    return Done{};
  }

  /// Reads a T for a constant and binds it.
  template <class T>
  Result<Done> setNumber(const std::string &name, const std::string &text,
                         const char *expected) {
    T value{};
    const char *end = text.data() + text.size();
    auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end)
      return fail("constant '" + name + "': expected " + expected +
                  ", but got '" + text + "'");
    if (pikort_bind_constant(pipeline, name.c_str(), &value, sizeof value) !=
        PIKORT_OK)
      return lastError();
    return Done{};
  }

  Result<Done> setConstant(const std::string &name, const std::string &text) {
    for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
      pikort_state_info state;
      if (pikort_get_state_info(pipeline, i, &state) != PIKORT_OK)
        return lastError();
      if (state.kind != PIKORT_CONSTANT || state.name != name)
        continue;
      auto record = recordOf(state.record);
      if (!record)
        return record.error();
      if (!std::strcmp(record->name, "int"))
        return setNumber<int32_t>(name, text, "a whole number");
      if (!std::strcmp(record->name, "float"))
        return setNumber<float>(name, text, "a number");
      return fail(unsuitable("constant '" + name + "'", record->name,
                             "an 'int' or a 'float' to set"));
    }
    return fail("expected a constant '" + name + "' to set, but it has none");
  }

  Result<Done> noteImage(const pikort_state_info &state,
                         const pikort_record_info &record) {
    if (!isColor(record.name))
      return Done{};
    if (!output.empty())
      return fail("expected one image of colours for the result, but got '" +
                  output + "' and '" + state.name + "'");
    if (state.rank != 2)
      return fail("image '" + std::string(state.name) +
                  "': expected 2 dimensions, but got " +
                  std::to_string(state.rank));
    output = state.name;
    return Done{};
  }

  Result<Done> bindSource(int32_t index) {
    pikort_source_info source;
    if (pikort_get_source_info(pipeline, index, &source) != PIKORT_OK)
      return lastError();
    auto record = recordOf(source.record);
    if (!record)
      return record.error();
    if (auto ok = prepare(record->name); !ok)
      return ok.error();
    Supply supply = sourceFor(record->name);
    if (!supply.size && scene.table) {
      auto lines = supplyTable(index, source.record, record->name);
      if (!lines)
        return lines.error();
      supply = *lines;
    }
    if (!supply.size)
      return fail(unsuitable("source " + std::to_string(index), record->name,
                             "'piko::scene::Vertex', '...::Triangle', "
                             "'...::Patch', '...::Pixel', '...::Nothing' or a "
                             "table in the place of the scene"));
    if (pikort_bind_source(pipeline, index, supply.data, supply.count,
                           supply.size) != PIKORT_OK)
      return lastError();
    return Done{};
  }

  pikort_pipeline *pipeline;
  SceneInput &scene;
  std::string output;
  int32_t fed = -1; ///< the source that the table feeds
};

} // namespace

Result<std::string> render::bindScene(pikort_pipeline *pipeline,
                                      SceneInput &scene) {
  return Binder(pipeline, scene).bind();
}

Result<std::vector<Count>> render::readCounters(pikort_pipeline *pipeline) {
  std::vector<Count> counts;
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info state;
    pikort_record_info record;
    if (pikort_get_state_info(pipeline, i, &state) != PIKORT_OK ||
        pikort_get_record(pipeline, state.record, &record) != PIKORT_OK)
      return Error{pikort_message(pipeline)};
    if (state.kind != PIKORT_BUFFER ||
        std::strcmp(record.name, "piko::scene::Counter") != 0)
      continue;
    pikort_view view;
    if (pikort_get_view(pipeline, state.name, &view) != PIKORT_OK)
      return Error{pikort_message(pipeline)};
    Count count{state.name, 0};
    for (int64_t k = 0; k < view.extent[0]; ++k)
      count.sum += static_cast<const scene::Counter *>(view.data)[k].count;
    counts.push_back(std::move(count));
  }
  return counts;
}
