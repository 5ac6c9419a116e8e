//===- piko/reference/stage.h - What a stage's phases can say -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_STAGE_H
#define PIKO_REFERENCE_STAGE_H

#include <piko/macros_begin.h>

#include <piko/reference/calls.h>
#include <piko/update.h>

#include <tuple>

namespace piko {

namespace reference {

/// A stage, perhaps one that its pipeline never names.
struct Member {
  const void *stage; ///< its BasicStage
  const TypeInfo *inputType;
  bool isNamed = false;
};

/// Where stages enter themselves that are members of the pipeline under
/// construction.
inline std::vector<Member> *&membersUnderConstruction() {
  static thread_local std::vector<Member> *members = nullptr;
  return members;
}

} // namespace reference

/// The primitives that a list Process is called with.
template <class T> class List {
public:
  List(const T *primitives, int64_t count)
      : primitives(primitives), count(count) {}

  int64_t size() const { return count; }
  bool empty() const { return count == 0; }
  const T &operator[](reference::Index i) const {
    if (i < 0 || i >= count)
      reference::failIndex(i, count, reference::placeOf(i));
    return primitives[i];
  }
  const T *begin() const { return primitives; }
  const T *end() const { return primitives + count; }

private:
  const T *primitives;
  int64_t count;
};

/// The second base of a stage that uses the pipeline's state.
template <class State> class Uses : public reference::Uses<State> {
public:
  State &state() const {
    State *bound = reference::Uses<State>::state;
    if (!bound)
      throw Error("state() of a stage that is in no pipeline");
    return *bound;
  }
};

/// The base of all stages: `In` goes in, one `Out` leaves through each port.
/// A stage defines
///   void assignBin(const In &);    // which bins? (bin 0 of a one-bin grid)
///   void schedule(BinId);          // when and where? (LoadBalance)
///   void process(const In &);      // or process(const List<In> &)
template <class B, int Threads, class In, class... Out> class BasicStage {
  static_assert(Threads >= 1, "a bin has at least one thread");
  static_assert(std::is_trivially_copyable_v<In> &&
                    (std::is_trivially_copyable_v<Out> && ...),
                "primitives must be trivially copyable");
  static_assert(alignof(In) <= alignof(std::max_align_t),
                "primitives cannot be over-aligned");

public:
  // Any phase.

  /// The bin that holds a position or a cell; BinId{-1} outside the domain.
  BinId binFromPosition(
      const Position<B::rank> &p,
      reference::SourcePlace at = reference::SourcePlace::current()) const {
    const reference::CallFrame &call =
        reference::frameAt("binFromPosition", at);
    reference::checkExtent(call);
    return {call.node->grid.binAt(reference::toCell(p))};
  }
  BinId binFromPosition(
      const Cells<B::rank> &p,
      reference::SourcePlace at = reference::SourcePlace::current()) const {
    return {reference::frameAt("binFromPosition", at)
                .node->grid.binAt(reference::toCell(p))};
  }
  /// The extent of the domain in cells.
  Cells<B::rank>
  domain(reference::SourcePlace at = reference::SourcePlace::current()) const {
    return reference::fromCell<B::rank>(
        reference::frameAt("domain", at).node->grid.domain);
  }

  // Schedule and Process.

  /// The bin that is scheduled or processed.
  BinId
  bin(reference::SourcePlace at = reference::SourcePlace::current()) const {
    return {reference::frameInBin("bin", at).bin};
  }
  /// Its first cell, and one past its last cell.
  Cells<B::rank>
  binLo(reference::SourcePlace at = reference::SourcePlace::current()) const {
    const reference::CallFrame &call = reference::frameInBin("binLo", at);
    return reference::fromCell<B::rank>(call.node->grid.lo(call.bin));
  }
  Cells<B::rank>
  binHi(reference::SourcePlace at = reference::SourcePlace::current()) const {
    const reference::CallFrame &call = reference::frameInBin("binHi", at);
    return reference::fromCell<B::rank>(call.node->grid.hi(call.bin));
  }

  // Positions and cells as braced lists of numbers.

  template <class T>
  BinId binFromPosition(
      const T (&p)[B::rank],
      reference::SourcePlace at = reference::SourcePlace::current()) const {
    return binFromPosition(detail::pointOf(p), at);
  }
  template <class T>
  void assignToBoundingBox(
      const In &in, const T (&lo)[B::rank], const T (&hi)[B::rank],
      reference::SourcePlace at = reference::SourcePlace::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  template <class T>
  void
  assignToLine(const In &in, const T (&a)[B::rank], const T (&b)[B::rank],
               reference::SourcePlace at = reference::SourcePlace::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), at);
  }

  // If they are of several types: floats.
  BinId binFromPosition(
      const float (&p)[B::rank],
      reference::SourcePlace at = reference::SourcePlace::current()) const {
    return binFromPosition(detail::pointOf(p), at);
  }
  void assignToBoundingBox(
      const In &in, const float (&lo)[B::rank], const float (&hi)[B::rank],
      reference::SourcePlace at = reference::SourcePlace::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  void
  assignToLine(const In &in, const float (&a)[B::rank],
               const float (&b)[B::rank],
               reference::SourcePlace at = reference::SourcePlace::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), at);
  }

  // Those of another number of dimensions are no positions.

  template <int Rank, class T>
    requires(Rank != B::rank)
  BinId binFromPosition(const glm::vec<Rank, T> &) const {
    static_assert(Rank == B::rank,
                  "expected as many dimensions as the bins of the stage have");
    return {};
  }
  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToBoundingBox(const In &, const glm::vec<Rank, T> &,
                           const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank,
                  "expected as many dimensions as the bins of the stage have");
  }
  template <int Rank, class T>
    requires(Rank != B::rank)
  void assignToLine(const In &, const glm::vec<Rank, T> &,
                    const glm::vec<Rank, T> &) {
    static_assert(Rank == B::rank,
                  "expected as many dimensions as the bins of the stage have");
  }

  // AssignBin. A primitive goes to the set of all bins that are named.

  void
  assignToBin(const In &, BinId bin,
              reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::executorAt("assignToBin", at).assignBin(bin.index);
  }
  void
  assignToAll(const In &,
              reference::SourcePlace at = reference::SourcePlace::current()) {
    int64_t bins = reference::frameAt("assignToAll", at).node->grid.bins();
    for (int64_t bin = 0; bin < bins; ++bin)
      reference::executorAt("assignToAll", at).assignBin(bin);
  }
  /// To the bin in which the producer emitted it.
  void assignToPreviousBins(const In &, reference::SourcePlace at =
                                            reference::SourcePlace::current()) {
    reference::CallFrame &call =
        reference::executorAt("assignToPreviousBins", at)
            .expect(reference::Phase::Assign, "assignToPreviousBins");
    if (!call.producer)
      call.node->fail(-1, "expected a previous stage, but the primitive is a "
                          "source's");
    if (call.producer->grid.size != call.node->grid.size)
      call.node->fail(-1, "expected bins of the same size as those of stage '" +
                              std::string(call.producer->name()) + "'");
    reference::executorAt("assignToPreviousBins", at).assignBin(call.bin);
  }
  /// To all bins that a closed box of cells touches; outside the domain there
  /// are none.
  void assignToBoundingBox(
      const In &, const Cells<B::rank> &lo, const Cells<B::rank> &hi,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::assignBox(reference::toCell(lo), reference::toCell(hi), B::rank,
                         at);
  }
  void assignToBoundingBox(
      const In &, const Position<B::rank> &lo, const Position<B::rank> &hi,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::expectNumbers("assignToBoundingBox", lo, hi, at);
    reference::assignBox(reference::toCell(lo), reference::toCell(hi), B::rank,
                         at);
  }
  /// To all bins that have a point of the segment from the middle of cell a to
  /// that of cell b.
  void
  assignToLine(const In &, const Cells<B::rank> &a, const Cells<B::rank> &b,
               reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::assignLine(reference::toCell(a), reference::toCell(b), B::rank,
                          at);
  }
  void
  assignToLine(const In &, const Position<B::rank> &a,
               const Position<B::rank> &b,
               reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::expectNumbers("assignToLine", a, b, at);
    reference::assignLine(reference::toCell(a), reference::toCell(b), B::rank,
                          at);
  }

  // Schedule.

  void specifySchedule(
      SchedulePolicy, int64_t tileSplit = 0,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::CallFrame &call =
        reference::frameInSchedule("specifySchedule", at);
    if (tileSplit < 0)
      call.node->fail(call.bin,
                      "expected a tile split of at least 0, but got " +
                          std::to_string(tileSplit));
  }
  /// Waits until all stages of type X are finished.
  template <class X>
  void endStage(reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::Node &node = *reference::frameInSchedule("endStage", at).node;
    const reference::TypeInfo *type = reference::typeOf<X>();
    if (std::find(node.waitsOn.begin(), node.waitsOn.end(), type) ==
        node.waitsOn.end())
      node.waitsOn.push_back(type);
  }
  /// Waits until nothing can reach this bin any more.
  void endBin(reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::frameInSchedule("endBin", at).node->endsBin = true;
  }
  /// Calls a list Process with n primitives at a time.
  void batch(int64_t n,
             reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::CallFrame &call = reference::frameInList("batch", at);
    if (n < 1)
      call.node->fail(call.bin, "expected a batch of at least 1, but got " +
                                    std::to_string(n));
    call.node->schedules[call.bin].batch = n;
  }
  /// Calls a list Process for empty bins, too.
  void everyBin(reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::CallFrame &call = reference::frameInList("everyBin", at);
    call.node->schedules[call.bin].everyBin = true;
  }
  void
  specifyOrder(Order order,
               reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::frameInSchedule("specifyOrder", at).node->unordered =
        order == Unordered;
  }
  /// What lanes are given, instead of what the compiler chooses.
  void
  specifyLanes(Lanes,
               reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::frameInSchedule("specifyLanes", at);
  }
  /// How exactly a compiled pipeline computes Process. The reference executor
  /// computes strictly.
  void specifyPrecision(
      Precision precision,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::frameInSchedule("specifyPrecision", at).node->precision =
        precision;
  }

  // Process.

  /// Sends a primitive through a port.
  void emit(const std::tuple_element_t<0, std::tuple<Out..., In>> &value,
            int port = 0,
            reference::SourcePlace at = reference::SourcePlace::current())
    requires(sizeof...(Out) > 0)
  {
    reference::emit(value, port, at);
  }
  template <class T>
  void emit(const T &value, int port = 0,
            reference::SourcePlace at = reference::SourcePlace::current()) {
    static_assert((std::is_same_v<T, Out> || ...),
                  "emit of a type that no port has");
    reference::emit(value, port, at);
  }

  /// Changes a pixel of the current bin: f(pixel). The calls for one pixel are
  /// in lineage order.
  template <class T, int R, class F>
  auto
  update(Image<T, R> &image, const typename detail::CellArgument<R>::type &at,
         F &&f,
         reference::SourcePlace place = reference::SourcePlace::current()) {
    PIKO_EXPECT_UPDATE(F);
    reference::CallFrame &call =
        reference::executorAt("update", place)
            .expect(reference::Phase::Process, "update");
    if (call.updating)
      call.node->fail(call.bin, "expected an update outside an update");
    reference::checkOwnPixel(call, reference::toCell(at), B::rank);
    struct Updating {
      bool &flag;
      ~Updating() { flag = false; }
    } updating{call.updating};
    call.updating = true;
    return image.update(at, place, std::forward<F>(f));
  }

  /// Calls f(0), ..., f(n - 1), which are independent of one another.
  template <class F>
  void
  parallelFor(int64_t n, F &&f,
              reference::SourcePlace at = reference::SourcePlace::current()) {
    static_assert(std::is_invocable_v<const std::remove_reference_t<F> &, int>,
                  "expected a function that can be called if it is const: "
                  "iterations share what it has captured by value");
    reference::executorAt("parallelFor", at).parallelFor(n, [&f](int64_t i) {
      f(static_cast<int>(i));
    });
  }
  /// Calls f(cell) for each cell of the current bin, x fastest.
  template <class F>
  void parallelForPixels(
      F &&f, reference::SourcePlace at = reference::SourcePlace::current()) {
    Cells<B::rank> lo = binLo(at), hi = binHi(at) - 1;
    parallelForPixels(lo, hi, std::forward<F>(f), at);
  }
  /// The same for the cells of the closed box from lo to hi that lie in the
  /// bin.
  template <class F>
  void parallelForPixels(
      const Cells<B::rank> &lo, const Cells<B::rank> &hi, F &&f,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    static_assert(
        std::is_invocable_v<const std::remove_reference_t<F> &,
                            Cells<B::rank> &>,
        "expected a function that can be called if it is const: iterations "
        "share what it has captured by value");
    reference::Cell first = reference::toCell(binLo(at)),
                    size = reference::toCell(binHi(at), 1);
    int64_t n = 1;
    for (int d = 0; d < B::rank; ++d) {
      int64_t end = std::min<int64_t>(size[d], int64_t(hi[d]) + 1);
      first[d] = std::max<int64_t>(first[d], lo[d]);
      size[d] = std::max<int64_t>(end - first[d], 0);
      n *= size[d];
    }
    reference::executorAt("parallelForPixels", at)
        .parallelFor(n, [&f, first, size](int64_t i) {
          Cells<B::rank> cell;
          for (int d = 0; d < B::rank; ++d) {
            cell[d] = static_cast<int>(first[d] + i % size[d]);
            i /= size[d];
          }
          f(cell);
        });
  }
  template <class F>
    requires(B::rank == 1)
  void parallelForPixels(
      int lo, int hi, F &&f,
      reference::SourcePlace at = reference::SourcePlace::current()) {
    parallelForPixels(Cells<1>(lo), Cells<1>(hi), std::forward<F>(f), at);
  }
  template <int Rank, class T, class F>
    requires(Rank != B::rank)
  void parallelForPixels(const glm::vec<Rank, T> &, const glm::vec<Rank, T> &,
                         F &&) {
    static_assert(Rank == B::rank,
                  "expected as many dimensions as the bins of the stage have");
  }
  /// In an iteration of parallelFor: a barrier between all iterations.
  void sync(reference::SourcePlace at = reference::SourcePlace::current()) {
    reference::executorAt("sync", at).sync({"sync"});
  }

  // Over the iterations of the enclosing parallelFor; each of them is also a
  // sync(). Every iteration gets the result.

  bool any(bool value,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countIterations("any", value, at) != 0;
  }
  bool all(bool value,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countIterations("all", !value, at) == 0;
  }
  int64_t count(bool value,
                reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countIterations("count", value, at);
  }
  /// op over all values, in a fixed binary tree.
  template <class T, class Op>
  T reduce(T value, Op op,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::collective<T, T>(
        "reduce", at, value, [&](const std::vector<T> &v) {
          return reference::reduceTree(v, op, T{});
        });
  }
  /// op over the values of the iterations before this one; `empty` in the
  /// first.
  template <class T, class Op>
  T scan(T value, Op op, T empty = T{},
         reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::collective<T, std::vector<T>>(
        "scan", at, value, [&](const std::vector<T> &v) {
          return reference::scanTree(v, op, empty);
        })[reference::currentIteration()];
  }
  /// Iteration r gets the index of the iteration with the r-th smallest key.
  template <class K>
  int64_t sort(K key,
               reference::SourcePlace at = reference::SourcePlace::current()) {
    static_assert(std::is_arithmetic_v<K>, "the key of sort is a number");
    return reference::collective<K, std::vector<int64_t>>(
        "sort", at, key, [](const std::vector<K> &keys) {
          return reference::sortedIndices(keys);
        })[reference::currentIteration()];
  }

  // Over f(0), ..., f(n - 1), outside parallelFor.

  template <class F>
  bool any(int64_t n, F &&f,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countTrue("any(n, f)", n, f, at) != 0;
  }
  template <class F>
  bool all(int64_t n, F &&f,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countTrue("all(n, f)", n, f, at) == n;
  }
  template <class F>
  int64_t count(int64_t n, F &&f,
                reference::SourcePlace at = reference::SourcePlace::current()) {
    return reference::countTrue("count(n, f)", n, f, at);
  }
  template <class T, class F, class Op>
  T reduce(int64_t n, F &&f, Op op, T empty,
           reference::SourcePlace at = reference::SourcePlace::current()) {
    std::vector<T> values(n);
    reference::frameOutsideLoop("reduce(n, f)", at)
        .parallelFor(n, [&](int64_t i) { values[i] = f(static_cast<int>(i)); });
    return reference::reduceTree(std::move(values), op, empty);
  }

protected:
  BasicStage() {
    if (auto *members = reference::membersUnderConstruction())
      members->push_back({this, reference::typeOf<In>()});
  }
};

/// A stage with two-dimensional bins of X by Y cells.
template <int X, int Y, int Threads, class In, class... Out>
using Stage = BasicStage<Bins<X, Y>, Threads, In, Out...>;

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_STAGE_H
