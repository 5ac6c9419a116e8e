//===- piko/compiled/stage.h - Stages for the compiler --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_COMPILED_STAGE_H
#define PIKO_COMPILED_STAGE_H

#include <piko/compiled/list.h>
#include <piko/compiled/messages.h>
#include <piko/compiled/state.h>
#include <piko/update.h>

#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wc++26-extensions" // computed messages

namespace piko {

namespace detail {

/// What iterations may be: a call that does not fit is an error where it
/// stands.
template <class F, class Argument>
concept Iteration = requires(F &f, Argument a) { f(a); };

/// A function of its own: what f declares belongs to the iteration.
template <class F> void iterate(F &f, int i) { f(i); }

/// Room for a T that nobody constructs.
template <class T> union Storage {
  Storage() {}
  T value;
};

template <int Rank> Cells<Rank> cellsOf(const Position<Rank> &p) {
  if constexpr (Rank == 1)
    return Cells<1>(cellOf(p.x));
  else if constexpr (Rank == 2)
    return Cells<2>(cellOf(p.x), cellOf(p.y));
  else if constexpr (Rank == 3)
    return Cells<3>(cellOf(p.x), cellOf(p.y), cellOf(p.z));
  else
    return Cells<4>(cellOf(p.x), cellOf(p.y), cellOf(p.z), cellOf(p.w));
}

/// Of what `get` gives for each dimension.
template <int Rank, class F> Cells<Rank> makeCells(F get) {
  if constexpr (Rank == 1)
    return Cells<1>(get(0));
  else if constexpr (Rank == 2)
    return Cells<2>(get(0), get(1));
  else if constexpr (Rank == 3)
    return Cells<3>(get(0), get(1), get(2));
  else
    return Cells<4>(get(0), get(1), get(2), get(3));
}

/// A function of its own, as iterate() is.
template <int Rank, class F> void iterateCell(F &f, int32_t i) {
  Cells<Rank> cell =
      makeCells<Rank>([i](int32_t dim) { return marker::cellAt(i, dim); });
  f(cell);
}

/// Calls f(cell) for each cell from `begin` up to `end`, x fastest.
template <int Rank, class F>
void iterateCells(const Cells<Rank> &begin, const Cells<Rank> &end, F &f) {
  int64_t n =
      marker::cellsOf(coordinate<0, Rank>(begin), coordinate<1, Rank>(begin),
                      coordinate<2, Rank>(begin), coordinate<3, Rank>(begin),
                      coordinate<0, Rank>(end), coordinate<1, Rank>(end),
                      coordinate<2, Rank>(end), coordinate<3, Rank>(end));
  for (int32_t i = marker::loopFirst(); marker::loopMore(i, n, 0);
       i = marker::loopNext(i))
    iterateCell<Rank>(f, i);
}

} // namespace detail

/// Gives a stage access to the state of its pipeline.
template <class S> class Uses {
public:
  S &state() const { return *marker::state<S>(); }
};

/// The base of stages: bins of B cells, `Threads` threads for a bin, a
/// primitive type in, and one out for each port.
template <class B, int Threads, class In, class... Out> class BasicStage {
  static_assert(Threads > 0, "a bin has at least one thread");

public:
  BasicStage() = default;
  BasicStage(const BasicStage &) = delete;
  BasicStage &operator=(const BasicStage &) = delete;

protected:
  template <class T> void emit(const T &value, int port = 0) {
    static_assert((detail::isSame<T, Out> || ...),
                  detail::portTypes<T, Out...>());
    T copy = value;
    marker::emit<T>(port, &copy);
  }
  void emit(const typename detail::First<Out..., In>::type &value, int port = 0)
    requires(sizeof...(Out) > 0)
  {
    emit<typename detail::First<Out..., In>::type>(value, port);
  }

  /// Changes a pixel of the current bin: f(pixel). The calls for one pixel are
  /// in lineage order.
  template <class T, int R, class F>
  auto update(Image<T, R> &image,
              const typename detail::CellArgument<R>::type &at, F &&f) {
    PIKO_EXPECT_UPDATE(F);
    using namespace detail;
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

  // Positions and cells as braced lists of numbers.
  template <class T> BinId binFromPosition(const T (&at)[B::rank]) const {
    return binFromPosition(detail::pointOf(at));
  }
  template <class T>
  void assignToBoundingBox(const In &in, const T (&lo)[B::rank],
                           const T (&hi)[B::rank]) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi));
  }
  template <class T>
  void assignToLine(const In &in, const T (&a)[B::rank],
                    const T (&b)[B::rank]) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b));
  }
  // If they are of several types: floats.
  BinId binFromPosition(const float (&at)[B::rank]) const {
    return binFromPosition(detail::pointOf(at));
  }
  void assignToBoundingBox(const In &in, const float (&lo)[B::rank],
                           const float (&hi)[B::rank]) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi));
  }
  void assignToLine(const In &in, const float (&a)[B::rank],
                    const float (&b)[B::rank]) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b));
  }
  // Those of another number of dimensions are no positions.
  template <int Rank, class T>
    requires(Rank != B::rank)
  BinId binFromPosition(const glm::vec<Rank, T> &) const {
    static_assert(Rank == B::rank, detail::dimensions<B::rank, Rank>());
    return {};
  }
  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToBoundingBox(const In &, const glm::vec<Rank, T> &,
                           const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank, detail::dimensions<B::rank, Rank>());
  }

  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToLine(const In &, const glm::vec<Rank, T> &,
                    const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank, detail::dimensions<B::rank, Rank>());
  }

  // AssignBin.
  void assignToBin(const In &, BinId bin) { marker::assignBin(bin.index); }
  void assignToAll(const In &) { marker::assignAll(); }
  void assignToPreviousBins(const In &) { marker::assignPrevious(); }
  void assignToBoundingBox(const In &, const Cells<B::rank> &lo,
                           const Cells<B::rank> &hi) {
    using namespace detail;
    marker::assignBox(coordinate<0, B::rank>(lo), coordinate<1, B::rank>(lo),
                      coordinate<2, B::rank>(lo), coordinate<3, B::rank>(lo),
                      coordinate<0, B::rank>(hi), coordinate<1, B::rank>(hi),
                      coordinate<2, B::rank>(hi), coordinate<3, B::rank>(hi));
  }
  void assignToBoundingBox(const In &in, const Position<B::rank> &lo,
                           const Position<B::rank> &hi) {
    bool isNumber = true;
    for (int dim = 0; dim < B::rank; ++dim)
      isNumber = isNumber && lo[dim] == lo[dim] && hi[dim] == hi[dim];
    if (isNumber)
      assignToBoundingBox(in, detail::cellsOf<B::rank>(lo),
                          detail::cellsOf<B::rank>(hi));
    else
      marker::assignBin(marker::nanPosition);
  }

  void assignToLine(const In &, const Cells<B::rank> &a,
                    const Cells<B::rank> &b) {
    using namespace detail;
    marker::assignLine(coordinate<0, B::rank>(a), coordinate<1, B::rank>(a),
                       coordinate<2, B::rank>(a), coordinate<3, B::rank>(a),
                       coordinate<0, B::rank>(b), coordinate<1, B::rank>(b),
                       coordinate<2, B::rank>(b), coordinate<3, B::rank>(b));
  }
  void assignToLine(const In &in, const Position<B::rank> &a,
                    const Position<B::rank> &b) {
    bool isNumber = true;
    for (int dim = 0; dim < B::rank; ++dim)
      isNumber = isNumber && a[dim] == a[dim] && b[dim] == b[dim];
    if (isNumber)
      assignToLine(in, detail::cellsOf<B::rank>(a),
                   detail::cellsOf<B::rank>(b));
    else
      marker::assignBin(marker::nanPosition);
  }

  // Queries.
  BinId binFromPosition(const Cells<B::rank> &at) const {
    using namespace detail;
    return BinId{
        marker::binAt(coordinate<0, B::rank>(at), coordinate<1, B::rank>(at),
                      coordinate<2, B::rank>(at), coordinate<3, B::rank>(at))};
  }
  BinId binFromPosition(const Position<B::rank> &at) const {
    marker::floatPosition();
    return binFromPosition(detail::cellsOf<B::rank>(at));
  }
  BinId bin() const { return BinId{marker::bin()}; }
  Cells<B::rank> domain() const {
    return detail::makeCells<B::rank>(
        [](int32_t dim) { return marker::domain(dim); });
  }
  Cells<B::rank> binLo() const {
    return detail::makeCells<B::rank>(
        [](int32_t dim) { return marker::binLo(marker::bin(), dim); });
  }
  Cells<B::rank> binHi() const {
    return detail::makeCells<B::rank>(
        [](int32_t dim) { return marker::binHi(marker::bin(), dim); });
  }

  /// Calls f(0), ..., f(n - 1), which are independent of one another.
  template <detail::Iteration<int> F> void parallelFor(int64_t n, F &&f) {
    for (int32_t i = marker::loopFirst(); marker::loopMore(i, n, 0);
         i = marker::loopNext(i))
      detail::iterate(f, i);
  }
  /// Calls f(cell) for each cell of the current bin, x fastest.
  template <detail::Iteration<Cells<B::rank> &> F>
  void parallelForPixels(F &&f) {
    detail::iterateCells<B::rank>(binLo(), binHi(), f);
  }
  /// The same for the cells of the closed box from lo to hi that lie in the
  /// bin.
  template <detail::Iteration<Cells<B::rank> &> F>
  void parallelForPixels(const Cells<B::rank> &lo, const Cells<B::rank> &hi,
                         F &&f) {
    Cells<B::rank> begin = binLo(), end = binHi();
    detail::iterateCells<B::rank>(
        detail::makeCells<B::rank>([&](int dim) {
          return lo[dim] > begin[dim] ? lo[dim] : begin[dim];
        }),
        detail::makeCells<B::rank>([&](int dim) {
          return (hi[dim] < end[dim] - 1 ? hi[dim] : end[dim] - 1) + 1;
        }),
        f);
  }
  template <class F>
    requires(B::rank == 1)
  void parallelForPixels(int lo, int hi, F &&f) {
    parallelForPixels(Cells<1>(lo), Cells<1>(hi), f);
  }
  template <int Rank, class T, class F>
    requires(Rank != B::rank)
  void parallelForPixels(const glm::vec<Rank, T> &, const glm::vec<Rank, T> &,
                         F &&) {
    static_assert(Rank == B::rank, detail::dimensions<B::rank, Rank>());
  }
  /// In an iteration of parallelFor: a barrier between all iterations.
  void sync() { marker::sync(); }

  // Over the iterations of the enclosing parallelFor; each of them is also a
  // sync(). Every iteration gets the result.

  bool any(bool value) { return count(value) != 0; }
  bool all(bool value) { return count(!value) == 0; }
  int64_t count(bool value) {
    return reduce(int64_t(value), [](int64_t a, int64_t b) { return a + b; });
  }
  /// op over all values, in a fixed binary tree.
  template <class T, class Op> T reduce(T value, Op op) {
    T a = value, b = value;
    marker::reduceBegin<T>(&a, &b, &value);
    T combined = op(a, b);
    marker::combineEnd<T>(&combined, &value);
    return value;
  }
  /// op over the values of the iterations before this one; `empty` in the
  /// first.
  template <class T, class Op> T scan(T value, Op op, T empty = T{}) {
    T a = value, b = value;
    marker::scanBegin<T>(&a, &b, &value, &empty);
    T combined = op(a, b);
    marker::combineEnd<T>(&combined, &value);
    return value;
  }
  /// Iteration r gets the index of the iteration with the r-th smallest key.
  template <class K> int64_t sort(K key) {
    return marker::sort<(static_cast<K>(-1) < static_cast<K>(0)), K>(key);
  }

  // Over f(0), ..., f(n - 1), outside parallelFor.

  template <class F> bool any(int64_t n, F &&f) { return count(n, f) != 0; }
  template <class F> bool all(int64_t n, F &&f) { return count(n, f) == n; }
  template <class F> int64_t count(int64_t n, F &&f) {
    return reduce<int64_t>(
        n, [&](int i) { return int64_t(bool(f(i))); },
        [](int64_t a, int64_t b) { return a + b; }, 0);
  }
  template <class T, class F, class Op>
  T reduce(int64_t n, F &&f, Op op, T empty) {
    T result[] = {empty};
    parallelFor(n, [&](int i) {
      T value = reduce<T>(f(i), op);
      if (i == 0)
        result[0] = value;
    });
    return result[0];
  }

  // Schedule.
  void specifySchedule(SchedulePolicy policy, int64_t tileSplit = 0) {
    marker::schedule(policy, tileSplit);
  }
  template <class S> void endStage() { marker::endStage<S>(); }
  void endBin() { marker::endBin(); }
  void batch(int64_t size) { marker::batch(size); }
  void everyBin() { marker::everyBin(); }
  void specifyOrder(Order order) { marker::order(order); }
  void specifyLanes(Lanes lanes) { marker::lanes(static_cast<int>(lanes)); }
  void specifyPrecision(Precision precision) {
    marker::precision(static_cast<int>(precision));
  }
};

template <int X, int Y, int Threads, class In, class... Out>
using Stage = BasicStage<Bins<X, Y>, Threads, In, Out...>;

namespace detail {
/// For the compiler: what goes into a stage.
template <class B, int Threads, class In, class... Out>
Identity<In> inputOf(const BasicStage<B, Threads, In, Out...> *);
} // namespace detail

} // namespace piko

#pragma clang diagnostic pop

#endif // PIKO_COMPILED_STAGE_H
