//===- piko/compiled/state.h - Buffers, images, atomics for the compiler --===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A Buffer or an Image holds nothing: its address in the state says which one
// it is. They cannot be copied, so that the address can always be known.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_STATE_H
#define PIKO_COMPILED_STATE_H

#include <piko/bins.h>
#include <piko/markers.h>

namespace piko {
namespace detail {

/// Coordinate `D` of a cell, and 0 past its last.
template <int D, int Rank> inline int64_t coordinate(const Cells<Rank> &at) {
  if constexpr (D >= Rank)
    return 0;
  else if constexpr (D == 0)
    return at.x;
  else if constexpr (D == 1)
    return at.y;
  else if constexpr (D == 2)
    return at.z;
  else
    return at.w;
}

} // namespace detail

template <class T> class Buffer final {
  static_assert(sizeof(T) != 0, "the elements of a buffer have a type");

public:
  Buffer() = default;
  Buffer(const Buffer &) = delete;
  Buffer &operator=(const Buffer &) = delete;

  int64_t size() const { return marker::extent(this, 0); }
  T &operator[](int64_t i) const {
    return *marker::element<T>(this, i, 0, 0, 0);
  }

  /// Of the elements in order: a loop that counts.
  class Iterator {
  public:
    Iterator(const Buffer &buffer, int64_t at) : buffer(buffer), at(at) {}
    T &operator*() const { return buffer[at]; }
    T *operator->() const { return &buffer[at]; }
    Iterator &operator++() {
      ++at;
      return *this;
    }
    bool operator!=(const Iterator &end) const { return at < end.at; }

  private:
    const Buffer &buffer;
    int64_t at;
  };
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }
};

template <class T, int Rank = 2> class Image final {
  static_assert(Rank >= 1 && Rank <= 4, "an image has one to four dimensions");
  static_assert(sizeof(T) != 0, "the pixels of an image have a type");

public:
  Image() = default;
  Image(const Image &) = delete;
  Image &operator=(const Image &) = delete;

  const T &operator()(const Cells<Rank> &at) const {
    return *pixel<const T>(at);
  }
  void store(const Cells<Rank> &at, const T &value) { *pixel<T>(at) = value; }
  Cells<Rank> extent() const {
    return detail::makeCells<Rank>([this](int dim) { return extent(dim); });
  }

private:
  /// A pixel; of a const U, only atomics may change it.
  template <class U> U *pixel(const Cells<Rank> &at) const {
    return marker::element<U>(
        this, detail::coordinate<0, Rank>(at), detail::coordinate<1, Rank>(at),
        detail::coordinate<2, Rank>(at), detail::coordinate<3, Rank>(at));
  }
  int extent(int dim) const { return marker::imageExtent(this, dim); }
};

namespace detail {
/// Says what an image is cleared to when a run begins.
template <class T, int Rank> inline void clearImage(const Image<T, Rank> &) {
  T value{};
  marker::clear<T>(&value);
}
/// Says what a constant is until the host sets it.
template <class T> inline void initializeConstant(const T &value) {
  marker::clear<T>(&value);
}
} // namespace detail

namespace detail {
template <class T>
concept AtomicInteger = isSame<T, int32_t> || isSame<T, uint32_t> ||
                        isSame<T, int64_t> || isSame<T, uint64_t> ||
                        isSame<T, long long> || isSame<T, unsigned long long>;
} // namespace detail

namespace detail {
template <class T>
concept AtomicFloat = isSame<T, float> || isSame<T, double>;
} // namespace detail

#define PIKO_ATOMIC(NAME, KIND)                                                \
  template <detail::AtomicInteger T>                                           \
  inline void NAME(const T &place, typename detail::Identity<T>::type value) { \
    marker::atomic<KIND, (static_cast<T>(-1) < static_cast<T>(0)), T>(         \
        const_cast<T *>(&place), value);                                       \
  }                                                                            \
  template <detail::AtomicInteger T>                                           \
  inline T NAME##Fetch(const T &place,                                         \
                       typename detail::Identity<T>::type value) {             \
    return marker::atomicFetch<KIND, (static_cast<T>(-1) < static_cast<T>(0)), \
                               T>(const_cast<T *>(&place), value);             \
  }                                                                            \
  template <class T>                                                           \
  void NAME(const T &&place, typename detail::Identity<T>::type value) =       \
      delete;                                                                  \
  template <class T>                                                           \
  T NAME##Fetch(const T &&place, typename detail::Identity<T>::type value) =   \
      delete;

PIKO_ATOMIC(atomicAdd, 0)
PIKO_ATOMIC(atomicMin, 1)
PIKO_ATOMIC(atomicMax, 2)
PIKO_ATOMIC(atomicAnd, 3)
PIKO_ATOMIC(atomicOr, 4)
PIKO_ATOMIC(atomicXor, 5)
#undef PIKO_ATOMIC

/// Adds to a float; only in a stage that is Unordered.
template <detail::AtomicFloat T>
inline void atomicAdd(const T &place,
                      typename detail::Identity<T>::type value) {
  marker::atomic<6, true, T>(const_cast<T *>(&place), value);
}

} // namespace piko

#endif // PIKO_COMPILED_STATE_H
