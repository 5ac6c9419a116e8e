// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- compiled.hpp - What the headers of compiled pipelines share --------===//
//
// pikoc makes a header for a pipeline, with a class that is used like the
// pipeline's C++ with the reference executor:
//
//   pipelines::DrawPipe pipe;
//   pipe.setDomain({20, 10});
//   pipe.state().offset = glm::vec2(2, 0);          // a constant
//   pipe.state().lights.assign(lights);             // a buffer, copied
//   pipe.feed(pipe.move, points);                   // a source, not copied
//   pipe.run().orThrow();                           // or look at the Status
//   auto marks = pipe.state().marks.view();         // an image
//   marks(3, 1).count;
//
// The class has a struct for each record that the host sees. Where one is
// expected any type will do that has its size, alignment and is trivially
// copyable, such as the one that the pipeline's C++ names; numbers must be of
// the same kind. No call throws but orThrow(). Unless an error is looked at
// before, run() has it: it fails while something is not bound.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_COMPILED_HPP
#define PIKORT_COMPILED_HPP

#include "pikort/pikort.hpp"

#include <algorithm>
#include <ranges>

namespace piko::rt {

/// T has the layout of the record R.
template <class T, class R>
concept LaidOutAs =
    std::is_trivially_copyable_v<T> && sizeof(T) == sizeof(R) &&
    alignof(T) % alignof(R) == 0 &&
    (std::is_arithmetic_v<R>
         ? std::is_enum_v<T> || (std::is_arithmetic_v<T> &&
                                 std::is_floating_point_v<T> ==
                                     std::is_floating_point_v<R>)
         : std::is_class_v<T> || std::is_union_v<T>);

/// A vector, an array or a span whose elements have the layout of R.
template <class Range, class R>
concept RangeOf =
    std::ranges::contiguous_range<Range> && std::ranges::sized_range<Range> &&
    LaidOutAs<std::ranges::range_value_t<Range>, R>;

/// A piece of state: a pipeline and the name that it has there.
struct Member {
  pikort_pipeline *pipeline;
  const char *name;

  Status status(int32_t code) const {
    return Status(code, pikort_message(pipeline));
  }
};

/// A value that is the same for a whole run.
template <class R> class Constant {
public:
  Constant(Member member) : member(member) {}
  Constant(const Constant &) = default;
  Constant &operator=(const Constant &) = delete;

  template <LaidOutAs<R> T> Status set(const T &value) {
    return member.status(pikort_bind_constant(member.pipeline, member.name,
                                              &value, sizeof(T)));
  }
  template <LaidOutAs<R> T> Constant &operator=(const T &value) {
    set(value);
    return *this;
  }
  Constant &operator=(const R &value) {
    set(value);
    return *this;
  }

private:
  Member member;
};

/// What the pipeline allocates: an image, or a buffer sized by a source. It can
/// be read and changed from a run to the next.
template <class R> class Elements {
public:
  Elements(Member member) : member(member) {}

  /// Empty before the first run.
  template <LaidOutAs<R> T = R> View<T> view() const {
    View<T> result;
    pikort_view raw;
    if (pikort_get_view(member.pipeline, member.name, &raw) != PIKORT_OK)
      return result;
    int64_t count = 1;
    for (int d = 0; d < 4; ++d)
      count *= result.extent[d] = raw.extent[d];
    result.elements = {static_cast<T *>(raw.data), static_cast<size_t>(count)};
    return result;
  }

protected:
  Member member;
};

/// An array that the host provides.
template <class R> class Buffer : public Elements<R> {
public:
  using Elements<R>::Elements;

  /// Uses the caller's memory, which must outlive the runs.
  template <RangeOf<R> Range> Status bind(Range &&range) {
    static_assert(std::is_lvalue_reference_v<Range> ||
                      std::ranges::enable_borrowed_range<Range>,
                  "bind does not copy; the elements must outlive the runs");
    static_assert(
        !std::is_const_v<
            std::remove_reference_t<std::ranges::range_reference_t<Range>>>,
        "a pipeline may write to a buffer; assign copies");
    return this->member.status(pikort_bind_buffer(
        this->member.pipeline, this->member.name, std::ranges::data(range),
        static_cast<int64_t>(std::ranges::size(range)), sizeof(R)));
  }
  /// Copies the elements.
  template <RangeOf<R> Range> Status assign(const Range &range) {
    if (Status s = allocate(static_cast<int64_t>(std::ranges::size(range))); !s)
      return s;
    using T = std::ranges::range_value_t<Range>;
    std::ranges::copy(range, this->template view<T>().elements.begin());
    return Status();
  }
  /// Makes elements whose bytes are zero.
  Status allocate(int64_t count) {
    return this->member.status(pikort_allocate_buffer(
        this->member.pipeline, this->member.name, count));
  }
};

/// Where primitives come in.
template <class R> class Source {
public:
  Source(pikort_pipeline *pipeline, int32_t number)
      : pipeline(pipeline), number(number) {}

  /// Uses the caller's memory, which must outlive the runs.
  template <RangeOf<R> Range> Status bind(const Range &range) {
    int32_t code = pikort_bind_source(
        pipeline, number, std::ranges::data(range),
        static_cast<int64_t>(std::ranges::size(range)), sizeof(R));
    return Status(code, pikort_message(pipeline));
  }

private:
  pikort_pipeline *pipeline;
  int32_t number;
};

/// The base of the classes that pikoc writes.
class CompiledPipeline {
public:
  /// How the creation went; where it failed, all else fails.
  const Status &created() const { return pipe.created(); }
  /// For the C functions; still owned by this object.
  pikort_pipeline *get() const { return pipe.get(); }

  Status setDomain(std::initializer_list<int64_t> extent) {
    return pipe.domain(extent);
  }
  Status setThreads(int32_t count) { return pipe.threads(count); }
  Status setMemoryLimit(int64_t bytes) { return pipe.memoryLimit(bytes); }
  Status setLoopLimit(int64_t limit) { return pipe.loopLimit(limit); }

  template <class R, RangeOf<R> Range>
  Status feed(Source<R> &source, Range &&primitives) {
    static_assert(std::is_lvalue_reference_v<Range> ||
                      std::ranges::enable_borrowed_range<Range>,
                  "feed does not copy; the primitives must outlive the run");
    return source.bind(primitives);
  }

  [[nodiscard]] Status run() { return pipe.run(); }

protected:
  explicit CompiledPipeline(const pikort_program &program) : pipe(program) {}
  CompiledPipeline(CompiledPipeline &&) = default;
  ~CompiledPipeline() = default;

private:
  Pipeline pipe;
};

} // namespace piko::rt

#endif // PIKORT_COMPILED_HPP
