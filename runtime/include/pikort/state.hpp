// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- state.hpp - State of compiled pipelines ----------------------------===//
//
// Constants, buffers and images as the headers of compiled pipelines have them.
// They have the members that those of the reference executor have for hosts.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_STATE_HPP
#define PIKORT_STATE_HPP

#include <piko/macros_begin.h>

#include "pikort/checked.hpp"
#include "pikort/layout.hpp"
#include "pikort/pikort.hpp"

#include <glm/ext/vector_int1.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstring>
#include <initializer_list>
#include <string>

namespace piko::rt {

/// A position or a size in cells.
template <int Rank> using Cells = glm::vec<Rank, int, glm::defaultp>;

/// A piece of state: a pipeline and the name that it has there.
struct Member {
  pikort_pipeline *pipeline;
  const char *name = nullptr;

  /// Another piece of the same pipeline.
  Member &operator()(const char *other) {
    name = other;
    return *this;
  }
  CheckedStatus status(int32_t code) const {
    return Status(code, pikort_message(pipeline));
  }
};

//===----------------------------------------------------------------------===//
// Constants
//===----------------------------------------------------------------------===//

/// A constant's value: a class whose members it has, ...
template <class R> class Value : public R {
public:
  Value() : R() {}
};

/// ... an array, ...
template <class E, size_t Count> class Value<E[Count]> {
public:
  using Elements = E[Count];
  operator Elements &() { return elements; }
  operator const Elements &() const { return elements; }
  E &operator[](size_t i) { return elements[i]; }
  const E &operator[](size_t i) const { return elements[i]; }
  E *begin() { return elements; }
  E *end() { return elements + Count; }
  const E *begin() const { return elements; }
  const E *end() const { return elements + Count; }

private:
  Elements elements{};
};

/// ... or a number.
template <class R>
  requires isNumber<R>
class Value<R> {
public:
  operator R &() { return number; }
  operator const R &() const { return number; }

  template <class T> R &operator+=(T t) { return number += t; }
  template <class T> R &operator-=(T t) { return number -= t; }
  template <class T> R &operator*=(T t) { return number *= t; }
  template <class T> R &operator/=(T t) { return number /= t; }
  template <class T> R &operator%=(T t) { return number %= t; }
  template <class T> R &operator&=(T t) { return number &= t; }
  template <class T> R &operator|=(T t) { return number |= t; }
  template <class T> R &operator^=(T t) { return number ^= t; }
  template <class T> R &operator<<=(T t) { return number <<= t; }
  template <class T> R &operator>>=(T t) { return number >>= t; }
  R &operator++() { return ++number; }
  R &operator--() { return --number; }
  R operator++(int) { return number++; }
  R operator--(int) { return number--; }

private:
  R number{};
};

/// A value that is the same for a whole run. It is what the pipeline's C++
/// says, or zero, until the host changes it. Its own names hide none that a
/// record is likely to have.
template <class R> class Constant : public Value<R> {
public:
  explicit Constant(Member &in) : pikoMember_(in) {
    pikort_view view;
    if (pikort_get_view(in.pipeline, in.name, &view) == PIKORT_OK &&
        view.record_size == sizeof(R))
      std::memcpy(static_cast<void *>(&pikoValue_()), view.data, sizeof(R));
  }
  Constant(const Constant &) = default;
  Constant &operator=(const Constant &other) {
    return pikoCopy_(other.pikoValue_());
  }
  Constant &operator=(const R &value) { return pikoCopy_(value); }
  template <LaidOutAs<R> T> Constant &operator=(const T &value) {
    return pikoCopy_(value);
  }
  template <LaidOutAs<R> T> CheckedStatus set(const T &value) {
    pikoCopy_(value);
    return Status();
  }

  /// Hands the value to the pipeline, for the next run.
  friend Status bindConstant(const Constant &constant) {
    const Member &member = constant.pikoMember_;
    return Status(pikort_bind_constant(member.pipeline, member.name,
                                       &constant.pikoValue_(), sizeof(R)),
                  pikort_message(member.pipeline));
  }

private:
  R &pikoValue_() { return *this; }
  const R &pikoValue_() const { return *this; }
  template <class T> Constant &pikoCopy_(const T &value) {
    static_assert(sizeof(T) == sizeof(R));
    std::memmove(static_cast<void *>(&pikoValue_()),
                 static_cast<const void *>(&value), sizeof(R));
    return *this;
  }

  Member pikoMember_;
};

/// Hands over one after the other.
template <class... R> Status bindConstants(const Constant<R> &...constants) {
  Status status;
  (void)((status = bindConstant(constants), bool(status)) && ...);
  return status;
}

//===----------------------------------------------------------------------===//
// Elements
//===----------------------------------------------------------------------===//

#ifdef __cpp_exceptions
[[noreturn]] inline void failIndex(int64_t index, int64_t count) {
  throw Error("expected an index in [0, " + std::to_string(count) +
                  "), but got " + std::to_string(index),
              PIKORT_INDEX_OUTSIDE);
}
#else
inline void failIndex(int64_t, int64_t) {}
#endif

/// What the pipeline knows as an array of records. It can be read and changed
/// from a run to the next. Each call looks up where that is: data() and view()
/// are for loops.
template <class R> class Elements {
public:
  using value_type = R;

  explicit Elements(Member &in) : where(in) {}

  /// Empty before the first run.
  template <LaidOutAs<R> T = R> View<T> view() const {
    View<T> result;
    pikort_view raw;
    if (!find(raw))
      return result;
    int64_t count = 1;
    for (int d = 0; d < 4; ++d)
      count *= result.extent[d] = raw.extent[d];
    result.elements = {static_cast<T *>(raw.data), static_cast<size_t>(count)};
    return result;
  }
  /// Where runs leave them on the device that the pipeline is on, without a
  /// copy and without waiting; empty before the first run, where the host's
  /// memory is bound, and on the processor. See pikort_get_device_view.
  template <LaidOutAs<R> T = R> DeviceView<T> deviceView() const {
    pikort_device_view raw;
    if (pikort_get_device_view(where.pipeline, where.name, &raw) != PIKORT_OK)
      return {};
    return deviceViewOf<T>(raw);
  }
  /// Copies all of them to the host, wherever they are; a vector has as many as
  /// there are, in x, then y, and so on.
  template <RangeOf<R> Range> CheckedStatus read(Range &&to) const {
    return where.status(
        pikort_read(where.pipeline, where.name, std::ranges::data(to),
                    static_cast<int64_t>(std::ranges::size(to)), sizeof(R)));
  }
  R *data() const { return view().elements.data(); }
  int64_t size() const { return static_cast<int64_t>(view().elements.size()); }

protected:
  bool find(pikort_view &raw) const {
    return pikort_get_view(where.pipeline, where.name, &raw) == PIKORT_OK;
  }

  Member where;
};

/// A buffer that the pipeline sizes by a source.
template <class R> class Array : public Elements<R> {
public:
  using Elements<R>::Elements;
  using const_iterator = const R *;

  R &operator[](int64_t i) const {
    View<R> view = this->view();
    auto count = static_cast<int64_t>(view.elements.size());
    if (i < 0 || i >= count)
      failIndex(i, count);
    return view.elements[static_cast<size_t>(i)];
  }
  R *begin() const { return this->data(); }
  R *end() const { return this->data() + this->size(); }
};

/// An array that the host provides.
template <class R> class Buffer : public Array<R> {
public:
  using Array<R>::Array;

  /// Uses the caller's memory, which must outlive the runs.
  template <LaidOutAs<R> T> CheckedStatus bind(T *data, int64_t count) {
    static_assert(!std::is_const_v<T>,
                  "a pipeline may write to a buffer; assign copies");
    return this->where.status(pikort_bind_buffer(
        this->where.pipeline, this->where.name, data, count, sizeof(R)));
  }
  template <RangeOf<R> Range> CheckedStatus bind(Range &&range) {
    static_assert(outlives<Range>,
                  "bind does not copy; the elements must outlive the runs");
    static_assert(
        !std::is_const_v<
            std::remove_reference_t<std::ranges::range_reference_t<Range>>>,
        "a pipeline may write to a buffer; assign copies");
    return bind(std::ranges::data(range),
                static_cast<int64_t>(std::ranges::size(range)));
  }
  /// Uses memory of the device that the pipeline is on, which the host cannot
  /// touch: read() copies it. See pikort_bind_device_buffer.
  template <LaidOutAs<R> T> CheckedStatus bind(DeviceSpan<T> elements) {
    static_assert(!std::is_const_v<T>, "a pipeline may write to a buffer");
    return this->where.status(pikort_bind_device_buffer(
        this->where.pipeline, this->where.name, elements.address(),
        static_cast<int64_t>(elements.size()), sizeof(R)));
  }
  /// Copies the elements.
  template <LaidOutAs<R> T>
  CheckedStatus assign(const T *elements, int64_t count) {
    Status status = allocate(count);
    if (status && count > 0)
      std::memcpy(static_cast<void *>(this->data()), elements,
                  static_cast<size_t>(count) * sizeof(R));
    return status;
  }
  template <RangeOf<R> Range> CheckedStatus assign(const Range &range) {
    return assign(std::ranges::data(range),
                  static_cast<int64_t>(std::ranges::size(range)));
  }
  CheckedStatus assign(std::initializer_list<R> values) {
    return assign(values.begin(), static_cast<int64_t>(values.size()));
  }
  /// Makes elements whose bytes are zero.
  CheckedStatus allocate(int64_t count) {
    return this->where.status(
        pikort_allocate_buffer(this->where.pipeline, this->where.name, count));
  }
};

/// A grid of pixels with the extent of the domain.
template <class R, int Rank> class Image : public Elements<R> {
public:
  using Elements<R>::Elements;

  const R &operator()(const Cells<Rank> &at) const {
    pikort_view raw;
    if (!this->find(raw))
      raw = {};
    int64_t index = 0;
    for (int d = Rank - 1; d >= 0; --d) {
      if (at[d] < 0 || at[d] >= raw.extent[d])
        failIndex(at[d], raw.extent[d]);
      index = index * raw.extent[d] + at[d];
    }
    return static_cast<const R *>(raw.data)[index];
  }
  /// Zero before the first run.
  Cells<Rank> extent() const {
    View<R> view = this->view();
    Cells<Rank> cells;
    for (int d = 0; d < Rank; ++d)
      cells[d] = static_cast<int>(view.extent[d]);
    return cells;
  }
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_STATE_HPP
