// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- pikort.hpp - The host API for C++ ----------------------------------===//
//
// A thin owner of a pikort_pipeline. A call that can fail returns a Status,
// which is true when it went well; only Status::orThrow throws.
//
//   piko::rt::Pipeline pipe(program);
//   if (auto s = pipe.domain({1024, 768}); !s) return report(s.message());
//   pipe.constant("camera", camera);
//   pipe.source(0, vertices);
//   if (auto s = pipe.run(); !s) return report(s.message());
//   auto color = pipe.view<Color>("color");
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_PIKORT_HPP
#define PIKORT_PIKORT_HPP

#include <piko/macros_begin.h>

#include "piko/status.h"
#include "pikort/device.hpp"
#include "pikort/pikort.h"
#include "pikort/ranks.hpp"

#include <initializer_list>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace piko::rt {

using piko::Error;
using piko::Status;

/// The elements of a piece of state; empty if it does not exist (yet).
template <class T> struct View {
  std::span<T> elements;
  int64_t extent[4] = {0, 0, 0, 0};
  T &operator()(int64_t x, int64_t y = 0, int64_t z = 0, int64_t w = 0) const {
    int64_t row = (w * extent[2] + z) * extent[1] + y;
    return elements[static_cast<size_t>(row * extent[0] + x)];
  }
};

/// Empty if T has another size.
template <class T> DeviceView<T> deviceViewOf(const pikort_device_view &raw) {
  DeviceView<T> view;
  if (raw.record_size != static_cast<int64_t>(sizeof(T)))
    return view;
  size_t count = 1;
  for (int d = 0; d < 4; ++d) {
    view.extent[d] = raw.extent[d];
    count *= static_cast<size_t>(raw.extent[d]);
  }
  view.elements = {raw.address, count};
  view.channels = raw.channels;
  view.type = raw.type;
  view.device = raw.device;
  return view;
}

/// Which device a pipeline is on, as pikort_create_on takes it.
struct Device {
  int32_t number = PIKORT_ANY_DEVICE;
};

class Pipeline {
public:
  /// Makes a pipeline; see created() for how that went.
  explicit Pipeline(const pikort_program &program, Device device = {}) {
    int32_t code = pikort_create_on(&program, device.number, &handle_);
    created_ = status(code);
  }
  Pipeline(Pipeline &&other) noexcept
      : ranks_(std::move(other.ranks_)),
        handle_(std::exchange(other.handle_, nullptr)),
        created_(std::move(other.created_)) {}
  Pipeline &operator=(Pipeline &&other) noexcept {
    std::swap(ranks_, other.ranks_);
    std::swap(handle_, other.handle_);
    std::swap(created_, other.created_);
    return *this;
  }
  Pipeline(const Pipeline &) = delete;
  Pipeline &operator=(const Pipeline &) = delete;
  ~Pipeline() { pikort_destroy(handle_); }

  /// How the creation went.
  const Status &created() const { return created_; }
  /// The device that it is on; PIKORT_PROCESSOR if on none.
  Device device() const { return {pikort_device(handle_)}; }
  /// For the C functions; still owned by this object.
  pikort_pipeline *get() const { return handle_; }

  Status domain(std::initializer_list<int64_t> extent) {
    return status(pikort_set_domain(
        handle_, static_cast<int32_t>(extent.size()), extent.begin()));
  }
  Status threads(int32_t count) {
    return status(pikort_set_threads(handle_, count));
  }
  /// Whether the host's memory that is bound stays as it is from run to run.
  Status staticInput(bool on) {
    return status(pikort_set_static_input(handle_, on));
  }
  Status memoryLimit(int64_t bytes) {
    return status(pikort_set_memory_limit(handle_, bytes));
  }
  Status memoryBudget(int64_t bytes) {
    return status(pikort_set_memory_budget(handle_, bytes));
  }
  Status stripSize(int64_t primitives) {
    return status(pikort_set_strip_size(handle_, primitives));
  }
  /// Which versions of its loops run; see pikort_set_mappings.
  Status mappings(const char *setting) {
    return status(pikort_set_mappings(handle_, setting));
  }
  Status loopLimit(int64_t limit) {
    return status(pikort_set_loop_limit(handle_, limit));
  }
  /// Makes it one rank of several; see pikort_set_ranks.
  Status ranks(const Communicator &communicator) {
    if (!communicator.created())
      return communicator.created();
    Status done = status(pikort_set_ranks(handle_, communicator.get()));
    if (done)
      ranks_ = communicator;
    return done;
  }
  /// Makes it several ranks in threads; see pikort_set_thread_ranks.
  Status threadRanks(int32_t count) {
    return status(pikort_set_thread_ranks(handle_, count));
  }
  template <class T> Status constant(const char *name, const T &value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_bind_constant(handle_, name, &value, sizeof(T)));
  }
  /// Binds a host's array, which must outlive the runs.
  template <class T> Status buffer(const char *name, std::span<T> data) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_bind_buffer(handle_, name, data.data(),
                                     static_cast<int64_t>(data.size()),
                                     sizeof(T)));
  }
  template <class T> Status buffer(const char *name, std::vector<T> &data) {
    return buffer(name, std::span<T>(data));
  }
  /// Binds memory of the device that the pipeline is on; see
  /// pikort_bind_device_buffer.
  template <class T> Status buffer(const char *name, DeviceSpan<T> data) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_bind_device_buffer(handle_, name, data.address(),
                                            static_cast<int64_t>(data.size()),
                                            sizeof(T)));
  }
  Status allocate(const char *name, int64_t count) {
    return status(pikort_allocate_buffer(handle_, name, count));
  }
  /// Binds a source's primitives, which must outlive the runs.
  template <class T> Status source(int32_t index, std::span<const T> data) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_bind_source(handle_, index, data.data(),
                                     static_cast<int64_t>(data.size()),
                                     sizeof(T)));
  }
  template <class T> Status source(int32_t index, const std::vector<T> &data) {
    return source(index, std::span<const T>(data));
  }
  template <class T> Status source(int32_t index, DeviceSpan<T> data) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_bind_device_source(handle_, index, data.address(),
                                            static_cast<int64_t>(data.size()),
                                            sizeof(T)));
  }
  /// Writes what a run would take to a file; see pikort_capture.
  Status capture(const std::string &path) {
    return status(pikort_capture(handle_, path.c_str()));
  }
  Status run() { return status(pikort_run(handle_)); }
  /// Gives a run to a stream; see pikort_run_async.
  Status runAsync(Stream stream = {}) {
    return status(pikort_run_async(handle_, stream.get()));
  }
  /// Waits for it; how it went.
  Status wait() { return status(pikort_wait(handle_)); }
  bool isDone() const { return pikort_is_done(handle_) != 0; }

  /// A buffer's or image's elements; empty if T has another size.
  template <class T> View<T> view(const char *name) {
    pikort_view raw;
    View<T> result;
    if (pikort_get_view(handle_, name, &raw) != PIKORT_OK ||
        raw.record_size != static_cast<int64_t>(sizeof(T)))
      return result;
    int64_t count = 1;
    for (int d = 0; d < 4; ++d)
      count *= result.extent[d] = raw.extent[d];
    result.elements = {static_cast<T *>(raw.data), static_cast<size_t>(count)};
    return result;
  }

  /// The same on the device, where runs have left them; see
  /// pikort_get_device_view.
  template <class T> DeviceView<T> deviceView(const char *name) {
    pikort_device_view raw;
    if (pikort_get_device_view(handle_, name, &raw) != PIKORT_OK)
      return {};
    return deviceViewOf<T>(raw);
  }
  /// Copies all elements of a buffer or an image to the host.
  template <class T> Status read(const char *name, std::span<T> to) {
    static_assert(std::is_trivially_copyable_v<T>);
    return status(pikort_read(handle_, name, to.data(),
                              static_cast<int64_t>(to.size()), sizeof(T)));
  }

private:
  Status status(int32_t code) const {
    return Status(code, pikort_message(handle_));
  }

  std::optional<Communicator> ranks_; // outlives the pipeline
  pikort_pipeline *handle_ = nullptr;
  Status created_;
};

} // namespace piko::rt

#include <piko/macros_end.h>

#endif // PIKORT_PIKORT_HPP
