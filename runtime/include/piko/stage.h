//===- piko/stage.h - What a stage's phases can say -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Stages, once for both meanings of the language. What a call does is a
// function of piko::detail::call, which the reference executor and the compiler
// each have: reference/stage.h runs it, compiled/stage.h calls markers. With it
// come detail::Place, where in the text a call is, and the macros that are
// undefined below:
//
//   PIKO_PORT_TYPES(T, Out), PIKO_DIMENSIONS(Bins, Got)   what static
//                                                         assertions say
//   PIKO_SAY(NAME, ...)   says a directive of piko/markers.def; there is an
//   `at`
//
// A stage's phases find no names but those of the language, so that nothing
// else is a member.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_STAGE_H
#define PIKO_STAGE_H

#include <piko/update.h>
#include <piko/wide_line.h>

#ifdef __PIKO__
#include <piko/compiled/stage.h>
#else
#include <piko/reference/stage.h>
#endif

#ifdef __clang__
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wc++26-extensions" // computed messages
#endif

namespace piko {

namespace detail {

/// What iterations may be: a call that does not fit is an error where it
/// stands.
template <class F, class Argument>
concept Iteration = requires(F &f, Argument a) { f(a); };

template <int Rank>
bool areNumbers(const Position<Rank> &a, const Position<Rank> &b) {
  bool isNumber = true;
  for (int dim = 0; dim < Rank; ++dim)
    isNumber = isNumber && a[dim] == a[dim] && b[dim] == b[dim];
  return isNumber;
}

/// Of positions or cells.
template <class B, class Ends>
void assignWideLine(const Place &at, const Ends &a, const Ends &b,
                    float width) {
  if (width != width)
    return call::assignNaN(at);
  WideLine<B::rank>(a, b, width)
      .template forEachBin<B>(
          call::domain<B::rank>(at), [&](const Cells<B::rank> &cell) {
            call::assignBin(at, call::binAt<B::rank>(at, cell));
          });
}

} // namespace detail

/// The base of all stages: bins of B cells, `Threads` threads for a bin, `In`
/// goes in, one `Out` leaves through each port. A stage defines
///   void assignBin(const In &);    // which bins? (bin 0 of a one-bin grid)
///   void schedule(BinId);          // when and where? (LoadBalance)
///   void process(const In &);      // or process(const List<In> &)
template <class B, int Threads, class In, class... Out> class BasicStage {
  static_assert(Threads >= 1, "a bin has at least one thread");

public:
  constexpr BasicStage() { detail::call::enterStage<In, Out...>(this); }
  BasicStage(const BasicStage &) = delete;
  BasicStage &operator=(const BasicStage &) = delete;

  // Any phase.

  /// The bin that holds a position or a cell; BinId{-1} outside the domain.
  BinId binFromPosition(const Cells<B::rank> &cell,
                        detail::Place at = detail::Place::current()) const {
    return BinId{detail::call::binAt<B::rank>(at, cell)};
  }
  BinId binFromPosition(const Position<B::rank> &position,
                        detail::Place at = detail::Place::current()) const {
    detail::call::floatPosition(at);
    return binFromPosition(detail::cellsOf<B::rank>(position), at);
  }
  /// The extent of the domain in cells.
  Cells<B::rank> domain(detail::Place at = detail::Place::current()) const {
    return detail::call::domain<B::rank>(at);
  }

  // Schedule and Process.

  /// The bin that is scheduled or processed.
  BinId bin(detail::Place at = detail::Place::current()) const {
    return BinId{detail::call::bin(at)};
  }
  /// Its first cell, and one past its last cell.
  Cells<B::rank> binLo(detail::Place at = detail::Place::current()) const {
    return detail::call::binLo<B::rank>(at);
  }
  Cells<B::rank> binHi(detail::Place at = detail::Place::current()) const {
    return detail::call::binHi<B::rank>(at);
  }

  // AssignBin. A primitive goes to the set of all bins that are named.

  void assignToBin(const In &, BinId bin,
                   detail::Place at = detail::Place::current()) {
    detail::call::assignBin(at, bin.index);
  }
  void assignToAll(const In &, detail::Place at = detail::Place::current()) {
    detail::call::assignAll(at);
  }
  /// To the bin in which the producer emitted it.
  void assignToPreviousBins(const In &,
                            detail::Place at = detail::Place::current()) {
    detail::call::assignPrevious(at);
  }
  /// To all bins that a closed box touches; outside the domain there are none.
  void assignToBoundingBox(const In &, const Cells<B::rank> &lo,
                           const Cells<B::rank> &hi,
                           detail::Place at = detail::Place::current()) {
    detail::call::assignBox<B::rank>(at, lo, hi);
  }
  void assignToBoundingBox(const In &in, const Position<B::rank> &lo,
                           const Position<B::rank> &hi,
                           detail::Place at = detail::Place::current()) {
    if (detail::areNumbers<B::rank>(lo, hi))
      assignToBoundingBox(in, detail::cellsOf<B::rank>(lo),
                          detail::cellsOf<B::rank>(hi), at);
    else
      detail::call::assignNaN(at);
  }
  /// To all bins that have a point of the segment from the middle of cell a to
  /// that of cell b.
  void assignToLine(const In &, const Cells<B::rank> &a,
                    const Cells<B::rank> &b,
                    detail::Place at = detail::Place::current()) {
    detail::call::assignLine<B::rank>(at, a, b);
  }
  void assignToLine(const In &in, const Position<B::rank> &a,
                    const Position<B::rank> &b,
                    detail::Place at = detail::Place::current()) {
    if (detail::areNumbers<B::rank>(a, b))
      assignToLine(in, detail::cellsOf<B::rank>(a), detail::cellsOf<B::rank>(b),
                   at);
    else
      detail::call::assignNaN(at);
  }

  /// To all bins that come as near as half of the width to the segment from a
  /// to b, in each dimension: of cells from middle to middle.
  void assignToLine(const In &, const Cells<B::rank> &a,
                    const Cells<B::rank> &b, float width,
                    detail::Place at = detail::Place::current()) {
    detail::assignWideLine<B>(at, a, b, width);
  }
  void assignToLine(const In &, const Position<B::rank> &a,
                    const Position<B::rank> &b, float width,
                    detail::Place at = detail::Place::current()) {
    if (detail::areNumbers<B::rank>(a, b))
      detail::assignWideLine<B>(at, a, b, width);
    else
      detail::call::assignNaN(at);
  }

  // Positions and cells as braced lists of numbers.

  template <class T>
  BinId binFromPosition(const T (&at)[B::rank],
                        detail::Place place = detail::Place::current()) const {
    return binFromPosition(detail::pointOf(at), place);
  }
  template <class T>
  void assignToBoundingBox(const In &in, const T (&lo)[B::rank],
                           const T (&hi)[B::rank],
                           detail::Place at = detail::Place::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  template <class T>
  void assignToLine(const In &in, const T (&a)[B::rank], const T (&b)[B::rank],
                    detail::Place at = detail::Place::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), at);
  }
  template <class T>
  void assignToLine(const In &in, const T (&a)[B::rank], const T (&b)[B::rank],
                    float width, detail::Place at = detail::Place::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), width, at);
  }
  // If they are of several types: floats.
  BinId binFromPosition(const float (&at)[B::rank],
                        detail::Place place = detail::Place::current()) const {
    return binFromPosition(detail::pointOf(at), place);
  }
  void assignToBoundingBox(const In &in, const float (&lo)[B::rank],
                           const float (&hi)[B::rank],
                           detail::Place at = detail::Place::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  void assignToLine(const In &in, const float (&a)[B::rank],
                    const float (&b)[B::rank],
                    detail::Place at = detail::Place::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), at);
  }
  void assignToLine(const In &in, const float (&a)[B::rank],
                    const float (&b)[B::rank], float width,
                    detail::Place at = detail::Place::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), width, at);
  }
  // Those of another number of dimensions are no positions.
  template <int Rank, class T>
    requires(Rank != B::rank)
  BinId binFromPosition(const glm::vec<Rank, T> &) const {
    static_assert(Rank == B::rank, PIKO_DIMENSIONS(B::rank, Rank));
    return {};
  }
  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToBoundingBox(const In &, const glm::vec<Rank, T> &,
                           const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank, PIKO_DIMENSIONS(B::rank, Rank));
  }
  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToLine(const In &, const glm::vec<Rank, T> &,
                    const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank, PIKO_DIMENSIONS(B::rank, Rank));
  }

  // Schedule.

  /// Which cores run bins; for All, into chunks of how many primitives a bin is
  /// cut.
  void specifySchedule(SchedulePolicy policy, int64_t tileSplit = 0,
                       detail::Place at = detail::Place::current()) {
    PIKO_SAY(schedule, policy, tileSplit);
  }
  /// Waits until all stages of type S are finished.
  template <class S>
  void endStage(detail::Place at = detail::Place::current()) {
    PIKO_SAY(template endStage<S>);
  }
  /// Waits until nothing can reach this bin any more.
  void endBin(detail::Place at = detail::Place::current()) { PIKO_SAY(endBin); }
  /// Calls a list Process with n primitives at a time.
  void batch(int64_t n, detail::Place at = detail::Place::current()) {
    PIKO_SAY(batch, n);
  }
  /// Calls a list Process for empty bins, too.
  void everyBin(detail::Place at = detail::Place::current()) {
    PIKO_SAY(everyBin);
  }
  void specifyOrder(Order order, detail::Place at = detail::Place::current()) {
    PIKO_SAY(order, order);
  }
  /// What lanes are given, instead of what the compiler chooses.
  void specifyLanes(Lanes lanes, detail::Place at = detail::Place::current()) {
    PIKO_SAY(lanes, static_cast<int32_t>(lanes));
  }
  /// How exactly a compiled pipeline computes Process. The reference executor
  /// computes strictly.
  void specifyPrecision(Precision precision,
                        detail::Place at = detail::Place::current()) {
    PIKO_SAY(precision, static_cast<int32_t>(precision));
  }
  /// How far functions such as piko::exp may be from the exact result in a
  /// compiled Process, in units in the last place (ULP) of a float, at least 1;
  /// cheaper ones are taken then. By default, all are within 0.501, and in
  /// Precision::Relaxed within 4.
  void specifyUlps(int64_t ulps, detail::Place at = detail::Place::current()) {
    PIKO_SAY(ulps, ulps);
  }
  /// What reports, traces and messages call the stage, and no other one.
  void specifyName(const char *name,
                   detail::Place at = detail::Place::current()) {
    PIKO_SAY(name, name);
  }

  // Process.

  /// Sends a primitive through a port.
  void emit(const typename detail::First<Out..., In>::type &value, int port = 0,
            detail::Place at = detail::Place::current())
    requires(sizeof...(Out) > 0)
  {
    emit<typename detail::First<Out..., In>::type>(value, port, at);
  }
  template <class T>
  void emit(const T &value, int port = 0,
            detail::Place at = detail::Place::current()) {
    static_assert((detail::isSame<T, Out> || ...), PIKO_PORT_TYPES(T, Out));
    detail::call::emit(at, value, port);
  }

  /// Changes a pixel of the current bin: f(pixel). The calls for one pixel are
  /// in lineage order.
  template <class T, int R, class F>
  auto update(Image<T, R> &image,
              const typename detail::CellArgument<R>::type &cell, F &&f,
              detail::Place at = detail::Place::current()) {
    PIKO_EXPECT_UPDATE(F);
    return detail::call::update<B::rank>(at, image, cell, f);
  }

  /// Calls f(0), ..., f(n - 1), which are independent of one another.
  template <detail::Iteration<int> F>
  void parallelFor(int64_t n, F &&f,
                   detail::Place at = detail::Place::current()) {
    detail::call::parallelFor(at, n, f);
  }
  /// Calls f(cell) for each cell of the current bin, x fastest.
  template <detail::Iteration<Cells<B::rank> &> F>
  void parallelForPixels(F &&f, detail::Place at = detail::Place::current()) {
    detail::call::parallelForCells<B::rank>(at, binLo(at), binHi(at), f);
  }
  /// The same for the cells of the closed box from lo to hi that lie in the
  /// bin.
  template <detail::Iteration<Cells<B::rank> &> F>
  void parallelForPixels(const Cells<B::rank> &lo, const Cells<B::rank> &hi,
                         F &&f, detail::Place at = detail::Place::current()) {
    Cells<B::rank> begin = binLo(at), end = binHi(at);
    detail::call::parallelForCells<B::rank>(
        at, detail::makeCells<B::rank>([&](int dim) {
          return lo[dim] > begin[dim] ? lo[dim] : begin[dim];
        }),
        detail::makeCells<B::rank>([&](int dim) {
          return (hi[dim] < end[dim] - 1 ? hi[dim] : end[dim] - 1) + 1;
        }),
        f);
  }
  template <class F>
    requires(B::rank == 1)
  void parallelForPixels(int lo, int hi, F &&f,
                         detail::Place at = detail::Place::current()) {
    parallelForPixels(Cells<1>(lo), Cells<1>(hi), f, at);
  }
  template <int Rank, class T, class F>
    requires(Rank != B::rank)
  void parallelForPixels(const glm::vec<Rank, T> &, const glm::vec<Rank, T> &,
                         F &&) {
    static_assert(Rank == B::rank, PIKO_DIMENSIONS(B::rank, Rank));
  }
  /// In an iteration of parallelFor: a barrier between all iterations.
  void sync(detail::Place at = detail::Place::current()) {
    detail::call::sync(at);
  }

  // Over the iterations of the enclosing parallelFor; each of them is also a
  // sync(). Every iteration gets the result.

  bool any(bool value, detail::Place at = detail::Place::current()) {
    return detail::call::count(at, "any", value) != 0;
  }
  bool all(bool value, detail::Place at = detail::Place::current()) {
    return detail::call::count(at, "all", !value) == 0;
  }
  int64_t count(bool value, detail::Place at = detail::Place::current()) {
    return detail::call::count(at, "count", value);
  }
  /// op over all values, in a fixed binary tree.
  template <class T, class Op>
  T reduce(T value, Op op, detail::Place at = detail::Place::current()) {
    return detail::call::reduce(at, value, op);
  }
  /// op over the values of the iterations before this one; `empty` in the
  /// first.
  template <class T, class Op>
  T scan(T value, Op op, T empty = T{},
         detail::Place at = detail::Place::current()) {
    return detail::call::scan(at, value, op, empty);
  }
  /// Iteration r gets the index of the iteration with the r-th smallest key.
  template <class K>
  int64_t sort(K key, detail::Place at = detail::Place::current()) {
    return detail::call::sort(at, key);
  }

  // Over f(0), ..., f(n - 1), outside parallelFor.

  template <class F>
  bool any(int64_t n, F &&f, detail::Place at = detail::Place::current()) {
    return detail::call::countTrue(at, "any(n, f)", n, f) != 0;
  }
  template <class F>
  bool all(int64_t n, F &&f, detail::Place at = detail::Place::current()) {
    return detail::call::countTrue(at, "all(n, f)", n, f) == n;
  }
  template <class F>
  int64_t count(int64_t n, F &&f, detail::Place at = detail::Place::current()) {
    return detail::call::countTrue(at, "count(n, f)", n, f);
  }
  template <class T, class F, class Op>
  T reduce(int64_t n, F &&f, Op op, T empty,
           detail::Place at = detail::Place::current()) {
    return detail::call::reduceOver<T>(at, n, f, op, empty);
  }
};

/// A stage with two-dimensional bins of X by Y cells.
template <int X, int Y, int Threads, class In, class... Out>
using Stage = BasicStage<Bins<X, Y>, Threads, In, Out...>;

namespace detail {
/// For the compiler: what goes into a stage.
template <class B, int Threads, class In, class... Out>
Identity<In> inputOf(const BasicStage<B, Threads, In, Out...> *);
} // namespace detail

} // namespace piko

#ifdef __clang__
#pragma clang diagnostic pop
#endif

#undef PIKO_DIMENSIONS
#undef PIKO_PORT_TYPES
#undef PIKO_SAY

#endif // PIKO_STAGE_H
