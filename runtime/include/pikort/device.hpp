// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- device.hpp - What lies on a device, and its streams ----------------===//
//
// No header of CUDA's is needed: pointers, addresses and streams are those of
// the driver API and of the runtime API alike.
//
//   pipe.feed(pipe.move, piko::rt::DeviceSpan(points, count)); // cudaMalloc's
//   pipe.runAsync(piko::rt::Stream(stream));                   // a
//   cudaStream_t auto color = pipe.state().color.deviceView(); show<<<blocks,
//   threads, 0, stream>>>(color.data(), color.pitch()); pipe.wait();
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_DEVICE_HPP
#define PIKORT_DEVICE_HPP

#include "pikort/pikort.h"

#include <concepts>
#include <cstddef>
#include <type_traits>

namespace piko::rt {

/// Elements in memory of a device, which the host cannot touch: a pointer that
/// knows so, and a number.
template <class T> class DeviceSpan {
public:
  using element_type = T;
  using value_type = std::remove_cv_t<T>;

  constexpr DeviceSpan() = default;
  /// As cudaMalloc, or thrust::raw_pointer_cast, gives it.
  constexpr DeviceSpan(T *data, size_t count) : data_(data), count_(count) {}
  /// A CUdeviceptr.
  template <std::unsigned_integral Address>
    requires(sizeof(Address) == sizeof(T *))
  DeviceSpan(Address address, size_t count)
      : data_(reinterpret_cast<T *>(address)), count_(count) {}
  /// Elements that may be changed are also some that are not to be.
  template <class U>
    requires std::is_convertible_v<U (*)[], T (*)[]>
  constexpr DeviceSpan(const DeviceSpan<U> &other)
      : data_(other.data()), count_(other.size()) {}

  /// For kernels; the host must not follow it.
  constexpr T *data() const { return data_; }
  uint64_t address() const { return reinterpret_cast<uint64_t>(data_); }
  constexpr size_t size() const { return count_; }
  constexpr size_t bytes() const { return count_ * sizeof(T); }
  constexpr bool empty() const { return count_ == 0; }
  /// `count` elements from `first` on, which it has.
  constexpr DeviceSpan subspan(size_t first, size_t count) const {
    return {data_ + first, count};
  }

private:
  T *data_ = nullptr;
  size_t count_ = 0;
};

/// The elements of an image or a buffer where a device has them; empty where
/// there is nothing (yet). Rows, planes and volumes follow each other without
/// gaps.
template <class T> struct DeviceView {
  DeviceSpan<T> elements;
  int64_t extent[4] = {0, 0, 0, 0}; ///< In elements, x first; unused = 1.
  int32_t channels = 0; ///< Scalars of an element, if all have one type; or 0.
  int32_t type = -1;    ///< pikort_field_type of these, or -1.
  int32_t device = PIKORT_PROCESSOR;

  T *data() const { return elements.data(); }
  uint64_t address() const { return elements.address(); }
  bool empty() const { return elements.empty(); }
  int64_t width() const { return extent[0]; }
  int64_t height() const { return extent[1]; }
  int64_t depth() const { return extent[2]; }
  /// Bytes from a row to the next.
  int64_t pitch() const { return extent[0] * static_cast<int64_t>(sizeof(T)); }
};

/// A stream that runs are in the order of: the pipeline's own, or a CUstream or
/// cudaStream_t of the host's, which may be 0.
class Stream {
public:
  Stream() = default;
  template <class Handle>
  explicit Stream(Handle *stream) : handle_(static_cast<void *>(stream)) {}
  explicit Stream(std::nullptr_t) : handle_(nullptr) {}

  void *get() const { return handle_; }

private:
  void *handle_ = PIKORT_OWN_STREAM;
};

} // namespace piko::rt

#endif // PIKORT_DEVICE_HPP
