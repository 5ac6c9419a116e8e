//===- piko/compiled/list.h - Lists of primitives for the compiler --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A List holds nothing, because a phase has only one; an iterator is an index.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_LIST_H
#define PIKO_COMPILED_LIST_H

#include <piko/bins.h>
#include <piko/markers.h>

#include <iterator>

namespace piko {

/// The primitives that a list Process is called with.
template <class T> class List {
public:
  class Iterator {
  public:
    using iterator_category = std::random_access_iterator_tag;
    using value_type = T;
    using difference_type = int64_t;
    using pointer = const T *;
    using reference = const T &;

    Iterator() = default;
    explicit Iterator(int64_t index) : index(index) {}

    reference operator*() const { return *marker::listAt<T>(index); }
    pointer operator->() const { return marker::listAt<T>(index); }
    reference operator[](int64_t n) const {
      return *marker::listAt<T>(index + n);
    }

    Iterator &operator++() { return *this += 1; }
    Iterator &operator--() { return *this -= 1; }
    Iterator operator++(int) { return Iterator(index++); }
    Iterator operator--(int) { return Iterator(index--); }
    Iterator &operator+=(int64_t n) {
      index += n;
      return *this;
    }
    Iterator &operator-=(int64_t n) {
      index -= n;
      return *this;
    }
    friend Iterator operator+(Iterator i, int64_t n) { return i += n; }
    friend Iterator operator+(int64_t n, Iterator i) { return i += n; }
    friend Iterator operator-(Iterator i, int64_t n) { return i -= n; }
    friend int64_t operator-(Iterator a, Iterator b) {
      return a.index - b.index;
    }
    friend bool operator==(Iterator a, Iterator b) {
      return a.index == b.index;
    }
    friend auto operator<=>(Iterator a, Iterator b) {
      return a.index <=> b.index;
    }

  private:
    int64_t index = 0;
  };
  using iterator = Iterator;
  using const_iterator = Iterator;
  using value_type = T;

  int64_t size() const { return marker::listSize(); }
  bool empty() const { return size() == 0; }
  const T &operator[](int64_t i) const { return *marker::listAt<T>(i); }
  Iterator begin() const { return Iterator(0); }
  Iterator end() const { return Iterator(size()); }
};

} // namespace piko

#endif // PIKO_COMPILED_LIST_H
