//===- Specialize.cpp - A pipeline for one scene --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Specialize.h"

#include <cstdio>
#include <cstring>

using namespace piko;
using namespace piko::render;

namespace {

/// Loops over this many elements may be worth unrolling.
constexpr int64_t mostElements = 64;

/// Finds what a bound pipeline's constants and buffers hold.
class ValueFinder {
public:
  explicit ValueFinder(pikort_pipeline *pipeline) : pipeline(pipeline) {}
  Result<Done> add(const std::string &name);
  std::vector<std::string> values;

private:
  Result<Done> addAll();
  Result<Done> addConstant(const pikort_state_info &state);
  void addField(const pikort_state_info &state, const pikort_field_info &field,
                const char *data);
  Result<Done> addSize(const pikort_state_info &state);
  /// Fails where there is no such state.
  Result<pikort_state_info> find(const std::string &name);
  Error lastError() const { return {pikort_message(pipeline)}; }

  pikort_pipeline *pipeline;
};

} // namespace

template <class T> static T read(const char *data) {
  T value;
  std::memcpy(&value, data, sizeof value);
  return value;
}

/// So that it is the same number when it is read again.
static std::string write(int32_t type, const char *data) {
  char text[40];
  switch (type) {
  case PIKORT_F32:
    std::snprintf(text, sizeof text, "%.9g", double(read<float>(data)));
    return text;
  case PIKORT_F64:
    std::snprintf(text, sizeof text, "%.17g", read<double>(data));
    return text;
  case PIKORT_I8:
    return std::to_string(read<int8_t>(data));
  case PIKORT_I16:
    return std::to_string(read<int16_t>(data));
  case PIKORT_I32:
    return std::to_string(read<int32_t>(data));
  default:
    return std::to_string(read<int64_t>(data));
  }
}

void ValueFinder::addField(const pikort_state_info &state,
                           const pikort_field_info &field, const char *data) {
  std::string path = std::string(state.name) + "." + field.name;
  if (path.find('[') != std::string::npos)
    return; // a row of an array whose rows are apart
  bool isArray = field.elements != 1 || field.stride != 0;
  for (int64_t i = 0; i < field.elements; ++i)
    values.push_back(path + (isArray ? "[" + std::to_string(i) + "]" : "") +
                     "=" +
                     write(field.type, data + field.offset + i * field.stride));
}

Result<Done> ValueFinder::addConstant(const pikort_state_info &state) {
  pikort_view view;
  pikort_record_info record;
  if (pikort_get_view(pipeline, state.name, &view) != PIKORT_OK ||
      pikort_get_record(pipeline, state.record, &record) != PIKORT_OK)
    return lastError();
  for (int32_t i = 0; i < record.field_count; ++i) {
    pikort_field_info field;
    if (pikort_get_field(pipeline, state.record, i, &field) != PIKORT_OK)
      return lastError();
    addField(state, field, static_cast<const char *>(view.data));
  }
  return Done{};
}

Result<Done> ValueFinder::addSize(const pikort_state_info &state) {
  pikort_view view;
  pikort_source_info source{};
  if (state.per_source < 0
          ? pikort_get_view(pipeline, state.name, &view) != PIKORT_OK
          : pikort_get_source_info(pipeline, state.per_source, &source) !=
                PIKORT_OK)
    return lastError();
  int64_t size = state.per_source < 0 ? view.extent[0] : source.count;
  values.push_back(std::string(state.name) + ".size=" + std::to_string(size));
  return Done{};
}

Result<pikort_state_info> ValueFinder::find(const std::string &name) {
  pikort_state_info state;
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i)
    if (pikort_get_state_info(pipeline, i, &state) == PIKORT_OK &&
        state.name == name)
      return state;
  return Error{"--fix: expected a constant, .size of a buffer, or all, but got "
               "'" +
               name + "'"};
}

Result<Done> ValueFinder::addAll() {
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info state;
    pikort_record_info record;
    if (pikort_get_state_info(pipeline, i, &state) != PIKORT_OK ||
        pikort_get_record(pipeline, state.record, &record) != PIKORT_OK)
      return lastError();
    bool isCamera = std::strcmp(record.name, "piko::scene::Camera") == 0;
    if (state.kind == PIKORT_CONSTANT && !isCamera)
      if (auto ok = addConstant(state); !ok)
        return ok;
    pikort_view view;
    if (state.kind == PIKORT_BUFFER && state.per_source < 0 &&
        pikort_get_view(pipeline, state.name, &view) == PIKORT_OK &&
        view.extent[0] <= mostElements)
      if (auto ok = addSize(state); !ok)
        return ok;
  }
  return Done{};
}

Result<Done> ValueFinder::add(const std::string &name) {
  if (name.find('=') != std::string::npos) {
    values.push_back(name);
    return Done{};
  }
  if (name == "all")
    return addAll();
  bool isSize = name.ends_with(".size");
  auto state = find(isSize ? name.substr(0, name.size() - 5) : name);
  if (!state)
    return state.error();
  if (state->kind != (isSize ? PIKORT_BUFFER : PIKORT_CONSTANT))
    return Error{"--fix: expected a constant, .size of a buffer, or all, but "
                 "got '" +
                 name + "'"};
  return isSize ? addSize(*state) : addConstant(*state);
}

Result<Options> render::specialize(Options options, pikort_pipeline *general) {
  ValueFinder finder(general);
  for (const std::string &name : options.fix)
    if (auto ok = finder.add(name); !ok)
      return ok.error();
  options.load.synthesis.fix = finder.values;
  return options;
}
