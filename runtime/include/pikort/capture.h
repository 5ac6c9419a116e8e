//===- pikort/capture.h - What a run takes, from a file ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// pikort_capture writes the domain, the options, all constants and buffers, and
// the primitives of the sources: what decides what a run does. They can be
// bound to a pipeline that was compiled anew, for another target, or from
// another form of the text, as long as its records are the same.
//
//===----------------------------------------------------------------------===//
#ifndef PIKORT_CAPTURE_H
#define PIKORT_CAPTURE_H

#include "pikort/pikort.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace piko::rt {

/// What a file begins with; another order of bytes has another number.
inline constexpr std::string_view captureMagic("piko capture 1\n\0", 16);

/// FNV-1a of 64 bits, over words of eight bytes and then the rest.
inline uint64_t captureSum(std::string_view bytes) {
  constexpr uint64_t prime = 0x100000001b3;
  uint64_t sum = 0xcbf29ce484222325;
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    uint64_t word;
    std::memcpy(&word, bytes.data() + i, 8);
    sum = (sum ^ word) * prime;
    sum ^= sum >> 32;
  }
  for (; i < bytes.size(); ++i)
    sum = (sum ^ static_cast<unsigned char>(bytes[i])) * prime;
  return sum;
}

/// The input of a run.
class Capture {
public:
  struct Field {
    std::string name;
    int64_t offset, elements, stride, type; ///< As pikort_field_info has them.

    bool operator==(const Field &) const = default;
  };
  struct Layout {
    std::string name;
    int64_t size; ///< In bytes, of a record.
    std::vector<Field> fields;
  };
  class Reader;
  /// Records of a constant, a buffer, or a source.
  struct Records {
    std::string name; ///< Of the state; of a source's stage.
    int64_t kind = 0; ///< pikort_state_kind; of a source 0.
    Layout layout;
    int64_t count = 0;

    void *data() { return memory.data(); }
    int64_t bytes() const { return count * layout.size; }

  private:
    friend class Reader;
    /// As aligned as any record is.
    struct alignas(64) Line {
      char bytes[64];
    };
    std::vector<Line> memory;
  };

  std::string pipeline; ///< Its name.
  int64_t rank = 0, domain[4] = {1, 1, 1, 1};
  int64_t stripSize = 0, memoryBudget = 0, loopLimit = 0;
  std::vector<Records> states, sources;

  static bool isCapture(std::string_view content) {
    return content.starts_with(captureMagic);
  }
  /// What a file holds. On an error it is left half-read, and the result says
  /// why; else the result is empty.
  [[nodiscard]] std::string read(std::string_view content);

  /// Sets domain and options, and binds all that the pipeline has of it; the
  /// capture must outlive the runs, which change the buffers that they write.
  /// The result says what does not fit, or is empty.
  [[nodiscard]] std::string bind(pikort_pipeline *pipeline);
};

// --- Reading ----------------------------------------------------------------

class Capture::Reader {
public:
  explicit Reader(std::string_view rest) : rest(rest) {}

  bool isWhole() const { return whole; }
  bool isAtEnd() const { return rest.empty(); }

  int64_t number() {
    int64_t value = 0;
    if (auto bytes = take(sizeof(value)); whole)
      std::memcpy(&value, bytes.data(), sizeof(value));
    return value;
  }
  /// Of a list, each element of which takes so many bytes at least.
  int64_t count(size_t leastBytes) {
    int64_t value = number();
    if (value < 0 || static_cast<uint64_t>(value) > rest.size() / leastBytes)
      whole = false;
    return whole ? value : 0;
  }
  std::string_view bytes() { return take(static_cast<uint64_t>(number())); }
  std::string string() { return std::string(bytes()); }

  Layout layout() {
    Layout result{string(), number(), {}};
    whole = whole && result.size > 0;
    int64_t fields = count(5 * sizeof(int64_t));
    for (int64_t i = 0; i < fields && whole; ++i) {
      std::string name = string();
      int64_t offset = number(), elements = number(), stride = number();
      result.fields.push_back({name, offset, elements, stride, number()});
    }
    return result;
  }
  Records records(bool hasKind) {
    Records result;
    result.name = string();
    result.kind = hasKind ? number() : 0;
    result.layout = layout();
    std::string_view data = bytes();
    auto size = static_cast<uint64_t>(result.layout.size);
    whole = whole && data.size() % size == 0;
    if (!whole)
      return result;
    result.count = static_cast<int64_t>(data.size() / size);
    result.memory.resize((data.size() + 63) / 64);
    if (!data.empty())
      std::memcpy(result.memory.data(), data.data(), data.size());
    return result;
  }

private:
  std::string_view take(uint64_t size) {
    whole = whole && size <= rest.size();
    if (!whole)
      return {};
    std::string_view taken = rest.substr(0, size);
    rest.remove_prefix(size);
    return taken;
  }

  std::string_view rest;
  bool whole = true;
};

inline std::string Capture::read(std::string_view content) {
  constexpr size_t sumBytes = sizeof(uint64_t);
  if (!isCapture(content))
    return "expected what pikort_capture has written";
  if (content.size() < captureMagic.size() + sumBytes)
    return "expected a whole file, but it is cut off";
  std::string_view summed = content.substr(0, content.size() - sumBytes);
  uint64_t sum = 0;
  std::memcpy(&sum, content.data() + summed.size(), sumBytes);
  if (sum != captureSum(summed))
    return "expected a whole file, but it is cut off or changed";
  Reader in(summed.substr(captureMagic.size()));
  pipeline = in.string();
  rank = in.number();
  for (int64_t &extent : domain)
    extent = in.number();
  stripSize = in.number();
  memoryBudget = in.number();
  loopLimit = in.number();
  constexpr size_t leastRecords = 4 * sizeof(int64_t);
  for (int64_t i = in.count(leastRecords); i > 0 && in.isWhole(); --i)
    states.push_back(in.records(/*hasKind=*/true));
  for (int64_t i = in.count(leastRecords); i > 0 && in.isWhole(); --i)
    sources.push_back(in.records(/*hasKind=*/false));
  bool isRight = in.isWhole() && in.isAtEnd() && rank >= 1 && rank <= 4;
  return isRight ? "" : "expected a file of another content";
}

// --- Binding ----------------------------------------------------------------

namespace detail {

/// How a record differs from a capture's; empty if it does not. Where both have
/// fields, their names may differ.
inline std::string compareLayout(const Capture::Layout &layout,
                                 pikort_pipeline *pipeline, int32_t index) {
  pikort_record_info record;
  if (pikort_get_record(pipeline, index, &record) != PIKORT_OK)
    return pikort_message(pipeline);
  if (record.size != layout.size)
    return "expected records of " + std::to_string(record.size) +
           " bytes, but the capture has " + std::to_string(layout.size);
  if (record.field_count != static_cast<int32_t>(layout.fields.size()))
    return "expected records of " + std::to_string(record.field_count) +
           " fields, but the capture has " +
           std::to_string(layout.fields.size());
  for (int32_t i = 0; i < record.field_count; ++i) {
    pikort_field_info field;
    if (pikort_get_field(pipeline, index, i, &field) != PIKORT_OK)
      return pikort_message(pipeline);
    const Capture::Field &other = layout.fields[static_cast<size_t>(i)];
    Capture::Field own{field.name, field.offset, field.elements, field.stride,
                       field.type};
    if (!(own == other))
      return "expected field '" + own.name + "' at " +
             std::to_string(own.offset) + ", but the capture has '" +
             other.name + "' at " + std::to_string(other.offset) +
             (own.type != other.type ? " of another type" : "");
  }
  return "";
}

} // namespace detail

inline std::string Capture::bind(pikort_pipeline *p) {
  auto failed = [&](int32_t code) { return code != PIKORT_OK; };
  if (pikort_rank(p) != rank)
    return "expected a domain of rank " + std::to_string(pikort_rank(p)) +
           ", but the capture has " + std::to_string(rank);
  if (failed(pikort_set_domain(p, static_cast<int32_t>(rank), domain)) ||
      failed(pikort_set_strip_size(p, stripSize)) ||
      failed(pikort_set_memory_budget(p, memoryBudget)) ||
      failed(pikort_set_loop_limit(p, loopLimit)))
    return pikort_message(p);
  if (static_cast<size_t>(pikort_source_count(p)) != sources.size())
    return "expected " + std::to_string(pikort_source_count(p)) +
           " sources, but the capture has " + std::to_string(sources.size());
  for (int32_t s = 0; s < pikort_state_count(p); ++s) {
    pikort_state_info info;
    if (failed(pikort_get_state_info(p, s, &info)))
      return pikort_message(p);
    if (info.kind == PIKORT_IMAGE || info.per_source >= 0)
      continue;
    for (Records &state : states) {
      if (state.name != info.name)
        continue;
      std::string who = "'" + state.name + "': ";
      if (state.kind != info.kind)
        return who + "expected a " +
               (info.kind == PIKORT_BUFFER ? "buffer" : "constant") +
               ", but the capture has another kind of state";
      if (std::string wrong =
              detail::compareLayout(state.layout, p, info.record);
          !wrong.empty())
        return who + wrong;
      if (info.kind == PIKORT_CONSTANT
              ? failed(pikort_bind_constant(p, info.name, state.data(),
                                            state.bytes()))
              : failed(pikort_bind_buffer(p, info.name, state.data(),
                                          state.count, state.layout.size)))
        return pikort_message(p);
    }
  }
  for (int32_t s = 0; s < pikort_source_count(p); ++s) {
    pikort_source_info info;
    if (failed(pikort_get_source_info(p, s, &info)))
      return pikort_message(p);
    Records &source = sources[static_cast<size_t>(s)];
    if (std::string wrong =
            detail::compareLayout(source.layout, p, info.record);
        !wrong.empty())
      return "source " + std::to_string(s) + ": " + wrong;
    if (failed(pikort_bind_source(p, s, source.data(), source.count,
                                  source.layout.size)))
      return pikort_message(p);
  }
  return "";
}

} // namespace piko::rt

#endif // PIKORT_CAPTURE_H
