//===- piko/compiled/stage.h - Stages for the compiler --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the calls of piko/stage.h are in a compiled pipeline.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_STAGE_H
#define PIKO_COMPILED_STAGE_H

#include <piko/compiled/list.h>
#include <piko/compiled/messages.h>
#include <piko/compiled/state.h>

#define PIKO_PORT_TYPES(T, Out) (::piko::detail::portTypes<T, Out...>())
#define PIKO_DIMENSIONS(Bins, Got) (::piko::detail::dimensions<Bins, Got>())
#define PIKO_SAY(NAME, ...) ::piko::marker::NAME(__VA_ARGS__)

namespace piko {

namespace detail {

/// Where a call is, the compiler knows.
struct Place {
  static consteval Place current() { return {}; }
};

/// A function of its own: what f declares belongs to the iteration.
template <class F> void iterate(F &f, int i) { f(i); }

/// The same for a cell.
template <int Rank, class F> void iterateCell(F &f, int32_t i) {
  Cells<Rank> cell =
      makeCells<Rank>([i](int32_t dim) { return marker::cellAt(i, dim); });
  f(cell);
}

/// Room for a T that nobody constructs.
template <class T> union Storage {
  Storage() {}
  T value;
};

namespace call {

template <class In, class... Out> constexpr void enterStage(const void *) {}

// Queries.
template <int Rank> int64_t binAt(Place, const Cells<Rank> &at) {
  return marker::binAt(coordinate<0, Rank>(at), coordinate<1, Rank>(at),
                       coordinate<2, Rank>(at), coordinate<3, Rank>(at));
}
inline void floatPosition(Place) { marker::floatPosition(); }
inline int64_t bin(Place) { return marker::bin(); }
template <int Rank> Cells<Rank> domain(Place) {
  return makeCells<Rank>([](int32_t dim) { return marker::domain(dim); });
}
template <int Rank> Cells<Rank> binLo(Place) {
  return makeCells<Rank>(
      [](int32_t dim) { return marker::binLo(marker::bin(), dim); });
}
template <int Rank> Cells<Rank> binHi(Place) {
  return makeCells<Rank>(
      [](int32_t dim) { return marker::binHi(marker::bin(), dim); });
}

// AssignBin.
inline void assignBin(Place, int64_t bin) { marker::assignBin(bin); }
inline void assignAll(Place) { marker::assignAll(); }
inline void assignPrevious(Place) { marker::assignPrevious(); }
inline void assignNaN(Place) { marker::assignBin(marker::nanPosition); }
template <int Rank>
void assignBox(Place, const Cells<Rank> &lo, const Cells<Rank> &hi) {
  marker::assignBox(coordinate<0, Rank>(lo), coordinate<1, Rank>(lo),
                    coordinate<2, Rank>(lo), coordinate<3, Rank>(lo),
                    coordinate<0, Rank>(hi), coordinate<1, Rank>(hi),
                    coordinate<2, Rank>(hi), coordinate<3, Rank>(hi));
}
template <int Rank>
void assignLine(Place, const Cells<Rank> &a, const Cells<Rank> &b) {
  marker::assignLine(coordinate<0, Rank>(a), coordinate<1, Rank>(a),
                     coordinate<2, Rank>(a), coordinate<3, Rank>(a),
                     coordinate<0, Rank>(b), coordinate<1, Rank>(b),
                     coordinate<2, Rank>(b), coordinate<3, Rank>(b));
}

// Process.
template <class T> void emit(Place, const T &value, int port) {
  T copy = value;
  marker::emit<T>(port, &copy);
}

template <int, class T, int R, class F>
auto update(Place, Image<T, R> &image, const Cells<R> &at, F &f) {
  Storage<T> pixel;
  marker::updateBegin<T>(&pixel.value, &image, coordinate<0, R>(at),
                         coordinate<1, R>(at), coordinate<2, R>(at),
                         coordinate<3, R>(at));
  if constexpr (isSame<decltype(f(pixel.value)), void>) {
    f(pixel.value);
    marker::updateEnd<T>(&pixel.value);
  } else {
    auto result = f(pixel.value);
    marker::updateEnd<T>(&pixel.value);
    return result;
  }
}

template <class F> void parallelFor(Place, int64_t n, F &f) {
  for (int32_t i = marker::loopFirst(); marker::loopMore(i, n, 0);
       i = marker::loopNext(i))
    detail::iterate(f, i);
}
template <int Rank, class F>
void parallelForCells(Place, const Cells<Rank> &begin, const Cells<Rank> &end,
                      F &f) {
  int64_t n =
      marker::cellsOf(coordinate<0, Rank>(begin), coordinate<1, Rank>(begin),
                      coordinate<2, Rank>(begin), coordinate<3, Rank>(begin),
                      coordinate<0, Rank>(end), coordinate<1, Rank>(end),
                      coordinate<2, Rank>(end), coordinate<3, Rank>(end));
  for (int32_t i = marker::loopFirst(); marker::loopMore(i, n, 0);
       i = marker::loopNext(i))
    detail::iterateCell<Rank>(f, i);
}
inline void sync(Place) { marker::sync(); }

// Barriers that exchange values.
template <class T, class Op> T reduce(Place, T value, Op op) {
  T a = value, b = value;
  marker::reduceBegin<T>(&a, &b, &value);
  T combined = op(a, b);
  marker::combineEnd<T>(&combined, &value);
  return value;
}
template <class T, class Op> T scan(Place, T value, Op op, const T &empty) {
  T a = value, b = value;
  marker::scanBegin<T>(&a, &b, &value, &empty);
  T combined = op(a, b);
  marker::combineEnd<T>(&combined, &value);
  return value;
}
template <class K> int64_t sort(Place, K key) {
  return marker::sort<(static_cast<K>(-1) < static_cast<K>(0)), K>(key);
}
inline int64_t count(Place at, const char *, bool value) {
  return call::reduce(at, int64_t(value),
                      [](int64_t a, int64_t b) { return a + b; });
}

// The same over f(0), ..., f(n - 1).
template <class T, class F, class Op>
T reduceOver(Place at, int64_t n, F &f, Op op, const T &empty) {
  T result[] = {empty};
  auto combine = [&](int i) {
    T value = call::reduce<T>(at, f(i), op);
    if (i == 0)
      result[0] = value;
  };
  call::parallelFor(at, n, combine);
  return result[0];
}
template <class F> int64_t countTrue(Place at, const char *, int64_t n, F &f) {
  auto one = [&](int i) { return int64_t(bool(f(i))); };
  return call::reduceOver<int64_t>(
      at, n, one, [](int64_t a, int64_t b) { return a + b; }, 0);
}

} // namespace call
} // namespace detail

/// Gives a stage access to the state of its pipeline.
template <class S> class Uses {
public:
  S &state() const { return *marker::state<S>(); }
};

} // namespace piko

#endif // PIKO_COMPILED_STAGE_H
