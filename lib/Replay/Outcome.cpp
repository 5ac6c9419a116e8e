// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Replay/Outcome.h"

#include "pikort/pikort.h"

#include <cstdio>
#include <cstring>
#include <stdexcept>

using namespace piko;
using namespace piko::replay;

namespace {

template <class T> T read(const char *at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

template <class T> bool equalFloats(const char *a, const char *b) {
  T x = read<T>(a), y = read<T>(b);
  return (x != x && y != y) || std::memcmp(a, b, sizeof(T)) == 0;
}

bool areEqual(int32_t type, const char *a, const char *b) {
  if (type == PIKORT_F32)
    return equalFloats<float>(a, b);
  if (type == PIKORT_F64)
    return equalFloats<double>(a, b);
  return std::memcmp(a, b, size_t(1) << (type - PIKORT_I8)) == 0;
}

std::string show(int32_t type, const char *at) {
  char text[64];
  switch (type) {
  case PIKORT_F32:
    std::snprintf(text, sizeof text, "%.9g", double(read<float>(at)));
    return text;
  case PIKORT_F64:
    std::snprintf(text, sizeof text, "%.17g", read<double>(at));
    return text;
  case PIKORT_I8:
    return std::to_string(read<int8_t>(at));
  case PIKORT_I16:
    return std::to_string(read<int16_t>(at));
  case PIKORT_I32:
    return std::to_string(read<int32_t>(at));
  default:
    return std::to_string(read<int64_t>(at));
  }
}

/// What differs between the records of one name; empty if nothing does.
std::string compareRecords(const Records &expected, const Records &actual) {
  if (expected.bytes.size() != actual.bytes.size() ||
      expected.size != actual.size)
    return " differs in size";
  int64_t count = 0, records = int64_t(expected.bytes.size()) / expected.size;
  std::string first;
  for (int64_t i = 0; i < records; ++i) {
    bool equal = true;
    for (const Field &field : expected.fields)
      for (int64_t e = 0; e < field.elements; ++e) {
        size_t at = size_t(i * expected.size + field.offset + e * field.stride);
        const char *a = &expected.bytes[at], *b = &actual.bytes[at];
        if (areEqual(field.type, a, b))
          continue;
        equal = false;
        if (first.empty())
          first = "first at " + std::to_string(i) + ": field '" + field.name +
                  "' should be " + show(field.type, a) + ", but is " +
                  show(field.type, b);
      }
    count += !equal;
  }
  if (count == 0)
    return "";
  return " differs in " + std::to_string(count) + " of " +
         std::to_string(records) + " records, " + first;
}

} // namespace

bool Outcome::isBlank() const {
  for (const auto &[name, records] : state)
    if (records.bytes.find_first_not_of('\0') != std::string::npos)
      return false;
  return error.empty();
}

std::vector<std::string> replay::compareOutcomes(const Outcome &expected,
                                                 const Outcome &actual) {
  std::vector<std::string> differences;
  if (!expected.error.empty() || !actual.error.empty()) {
    if (expected.error == actual.error)
      return {};
    if (!expected.error.empty())
      differences.push_back("  expected: " + expected.error);
    if (!actual.error.empty())
      differences.push_back("  got: " + actual.error);
    return differences;
  }
  for (const auto &[name, records] : expected.state) {
    auto found = actual.state.find(name);
    std::string what = found == actual.state.end()
                           ? " is missing"
                           : compareRecords(records, found->second);
    if (!what.empty())
      differences.push_back("'" + name + "'" + what);
  }
  return differences;
}

namespace {

/// FNV-1a, of bytes one after the other.
class Hash {
public:
  void add(std::string_view bytes) {
    for (char byte : bytes)
      value = (value ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
  }
  /// With its length, so that nothing runs into what follows.
  void addText(std::string_view text) {
    add(std::to_string(text.size()) + ":");
    add(text);
  }
  void addNumber(int32_t type, const char *at) {
    if (type == PIKORT_F32)
      return addFloat<float>(at);
    if (type == PIKORT_F64)
      return addFloat<double>(at);
    add({at, size_t(1) << (type - PIKORT_I8)});
  }

  uint64_t value = 0xcbf29ce484222325;

private:
  template <class T> void addFloat(const char *at) {
    auto number = read<T>(at);
    add(number != number ? std::string_view("nan")
                         : std::string_view(at, sizeof(T)));
  }
};

} // namespace

uint64_t replay::hashBytes(std::string_view bytes) {
  Hash hash;
  hash.add(bytes);
  return hash.value;
}

uint64_t replay::hashOutcome(const Outcome &outcome) {
  Hash hash;
  hash.addText(outcome.error);
  for (const auto &[name, records] : outcome.state) {
    hash.addText(name);
    hash.addText(std::to_string(records.bytes.size()));
    for (int64_t i = 0; i < int64_t(records.bytes.size()) / records.size; ++i)
      for (const Field &field : records.fields)
        for (int64_t e = 0; e < field.elements; ++e)
          hash.addNumber(field.type,
                         &records.bytes[size_t(i * records.size + field.offset +
                                               e * field.stride)]);
  }
  return hash.value;
}

static void check(pikort_pipeline *pipeline, int32_t code) {
  if (code != PIKORT_OK)
    throw std::runtime_error(pikort_message(pipeline));
}

std::vector<Field> replay::getFields(pikort_pipeline *pipeline,
                                     int32_t record) {
  pikort_record_info info;
  check(pipeline, pikort_get_record(pipeline, record, &info));
  std::vector<Field> fields;
  for (int32_t i = 0; i < info.field_count; ++i) {
    pikort_field_info field;
    check(pipeline, pikort_get_field(pipeline, record, i, &field));
    fields.push_back(
        {field.name, field.offset, field.elements, field.stride, field.type});
  }
  return fields;
}

Outcome replay::readOutcome(pikort_pipeline *pipeline) {
  Outcome outcome;
  for (int32_t i = 0; i < pikort_state_count(pipeline); ++i) {
    pikort_state_info info;
    check(pipeline, pikort_get_state_info(pipeline, i, &info));
    pikort_view view;
    check(pipeline, pikort_get_view(pipeline, info.name, &view));
    int64_t bytes = view.record_size;
    for (int64_t extent : view.extent)
      bytes *= extent;
    if (!bytes)
      continue;
    Records &records = outcome.state[info.name];
    records.bytes.assign(static_cast<const char *>(view.data), size_t(bytes));
    records.size = view.record_size;
    records.fields = getFields(pipeline, view.record);
  }
  return outcome;
}
