// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- compiled.hpp - What the headers of compiled pipelines share --------===//
//
// pikoc makes a header for a pipeline, with a class that is used like the
// pipeline's C++ with the reference executor, so that a template can use both:
//
//   pipelines::DrawPipe pipe;
//   pipe.setDomain({20, 10});
//   pipe.state().offset = glm::vec2(2, 0);          // a constant
//   pipe.state().lights.assign(lights);             // a buffer, copied
//   pipe.feed(pipe.move, points);                   // a source, not copied
//   pipe.run();                                     // or look at the status
//   pipe.state().marks({3, 1}).count;               // an image
//
// The class has a struct for each record that the host sees. Where one is
// expected any type will do that has its size, alignment and is trivially
// copyable, such as the one that the pipeline's C++ names; numbers must be of
// the same kind.
//
// pipelines::DrawPipe pipe{piko::rt::Device{1}} is on the second device, where
// the program has code for one. feed() and bind() take piko::rt::DeviceSpan for
// what lies there; runAsync() runs in a stream, and deviceView() says where
// results are (device.hpp).
//
// A call that can fail returns a status. If nobody looks at it, it is thrown,
// as a piko::Error. Without exceptions, run() fails while something is not
// bound.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_COMPILED_HPP
#define PIKORT_COMPILED_HPP

#include <piko/macros_begin.h>

#include "pikort/state.hpp"

namespace piko::rt {

/// Where primitives come in.
template <class R> class Source {
public:
  /// Of a stage with several sources, which are fed by number, it is -1.
  explicit Source(int32_t index) : number(index) {}

  const int32_t number;
};

/// The base of the classes that pikoc writes.
class CompiledPipeline {
public:
  /// How the creation went; where it failed, all else fails.
  const Status &created() const { return pipe.created(); }
  /// The device that it is on; PIKORT_PROCESSOR if on none.
  Device device() const { return pipe.device(); }
  /// For the C functions; still owned by this object.
  pikort_pipeline *get() const { return pipe.get(); }

  /// The extent of the domain in cells, one number for each dimension.
  CheckedStatus setDomain(std::initializer_list<int64_t> extent) {
    return pipe.domain(extent);
  }
  template <int Rank> CheckedStatus setDomain(const Cells<Rank> &extent) {
    int64_t values[Rank];
    for (int d = 0; d < Rank; ++d)
      values[d] = extent[d];
    return setDomain(values, Rank);
  }
  CheckedStatus setDomain(const int64_t *extent, int rank) {
    return status(pikort_set_domain(get(), rank, extent));
  }
  CheckedStatus setThreads(int32_t count) { return pipe.threads(count); }
  CheckedStatus setMemoryLimit(int64_t bytes) {
    return pipe.memoryLimit(bytes);
  }
  CheckedStatus setMemoryBudget(int64_t bytes) {
    return pipe.memoryBudget(bytes);
  }
  CheckedStatus setStripSize(int64_t primitives) {
    return pipe.stripSize(primitives);
  }
  /// Which versions of its loops run: see pikort_set_mappings.
  CheckedStatus setMappings(const std::string &setting) {
    return pipe.mappings(setting.c_str());
  }
  CheckedStatus setLoopLimit(int64_t limit) { return pipe.loopLimit(limit); }
  /// Makes it one rank of several, of a program that pikoc --ranks has made.
  CheckedStatus setRanks(const Communicator &communicator) {
    return pipe.ranks(communicator);
  }
  /// Makes it several ranks in threads of this process.
  CheckedStatus setThreadRanks(int32_t count) {
    return pipe.threadRanks(count);
  }

  /// The primitives of a source. Uses the caller's memory, which must outlive
  /// the runs. A pointer to void is not checked for its type.
  template <class T>
  CheckedStatus feed(int32_t source, const T *primitives, int64_t count) {
    int64_t size = 0;
    if constexpr (std::is_void_v<T>)
      size = recordSize(source);
    else
      size = sizeof(T);
    return status(pikort_bind_source(get(), source, primitives, count, size));
  }
  /// The same for a vector, an array or a span.
  template <std::ranges::contiguous_range Range>
  CheckedStatus feed(int32_t source, Range &&primitives) {
    static_assert(outlives<Range>,
                  "feed does not copy; the primitives must outlive the run");
    return feed(source, std::ranges::data(primitives),
                static_cast<int64_t>(std::ranges::size(primitives)));
  }
  /// The same for the only source of a stage.
  template <class R, RangeOf<R> Range>
  CheckedStatus feed(const Source<R> &source, Range &&primitives) {
    static_assert(outlives<Range>,
                  "feed does not copy; the primitives must outlive the run");
    if (source.number < 0)
      return feedByNumber();
    return feed(source.number, std::ranges::data(primitives),
                static_cast<int64_t>(std::ranges::size(primitives)));
  }

  /// Primitives in memory of the device that the pipeline is on; see
  /// pikort_bind_device_source.
  template <class T>
  CheckedStatus feed(int32_t source, DeviceSpan<T> primitives) {
    return status(pikort_bind_device_source(
        get(), source, primitives.address(),
        static_cast<int64_t>(primitives.size()), sizeof(T)));
  }
  template <class R, class T>
    requires LaidOutAs<std::remove_const_t<T>, R>
  CheckedStatus feed(const Source<R> &source, DeviceSpan<T> primitives) {
    if (source.number < 0)
      return feedByNumber();
    return feed(source.number, primitives);
  }

  /// Writes what a run would take to a file; see pikort_capture.
  CheckedStatus capture(const std::string &path) {
    if (Status status = bind(*this); !status)
      return status;
    return pipe.capture(path);
  }
  /// Clears the images and runs the pipeline on what was fed.
  CheckedStatus run() { return tryRun(); }
  /// The same; nothing is thrown.
  Status tryRun() {
    if (Status status = bind(*this); !status)
      return status;
    return pipe.run();
  }

  /// Gives a run to a stream: the host goes on, and wait() says how the run
  /// went. Until then it owns what was bound and fed; constants may be changed.
  /// See pikort_run_async.
  CheckedStatus runAsync(Stream stream = {}) { return tryRunAsync(stream); }
  Status tryRunAsync(Stream stream = {}) {
    if (Status status = bind(*this); !status)
      return status;
    return pipe.runAsync(stream);
  }
  CheckedStatus wait() { return pipe.wait(); }
  /// Whether wait() would not wait.
  bool isDone() const { return pipe.isDone(); }

protected:
  /// Hands the state's constants over before each run.
  using Bind = Status (*)(CompiledPipeline &);

  CompiledPipeline(const pikort_program &program, Bind constants,
                   Device device = {})
      : pipe(program, device), bind(constants) {}
  CompiledPipeline(CompiledPipeline &&) = default;
  ~CompiledPipeline() = default;

private:
  CheckedStatus status(int32_t code) const {
    return Status(code, pikort_message(get()));
  }
  static Status feedByNumber() {
    return Status(PIKORT_INVALID_ARGUMENT,
                  "a stage has several sources; feed them by number");
  }
  /// 0 if there is no such source.
  int64_t recordSize(int32_t source) const {
    pikort_source_info info;
    pikort_record_info record;
    bool isFound = pikort_get_source_info(get(), source, &info) == PIKORT_OK &&
                   pikort_get_record(get(), info.record, &record) == PIKORT_OK;
    return isFound ? record.size : 0;
  }

  Pipeline pipe;
  Bind bind;
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_COMPILED_HPP
