//===- piko/reference/stage.h - What a stage's phases can say -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_STAGE_H
#define PIKO_REFERENCE_STAGE_H

#include <piko/reference/atomics.h>
#include <piko/reference/collectives.h>

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

//===----------------------------------------------------------------------===//
// What the calls of a stage do. A stage's phases find no names but those of the
// language, so that these are no members.
//===----------------------------------------------------------------------===//

/// The executor, which is at a call of the language.
inline Executor &executorAt(const char *what, const Place &at) {
  Executor *running = Executor::current();
  if (!running || !running->frame)
    throw Error(std::string(what) + " outside a running pipeline");
  running->frame->at = at;
  return *running;
}
/// The same, outside parallelFor.
inline Executor &frameOutsideLoop(const char *what, const Place &at) {
  Executor &running = executorAt(what, at);
  const Frame &call = *running.frame;
  if (call.loop)
    call.node->fail(call.bin,
                    std::string("expected ") + what + " outside a parallelFor");
  return running;
}
inline Frame &frameAt(const char *what, const Place &at) {
  return *executorAt(what, at).frame;
}
inline Frame &frameInBin(const char *what, const Place &at) {
  Frame &call = frameAt(what, at);
  if (call.phase == Phase::Assign)
    call.node->fail(-1, std::string(what) + " in assignBin");
  return call;
}
inline Frame &frameInSchedule(const char *what, const Place &at) {
  return executorAt(what, at).expect(Phase::Schedule, what);
}
inline Frame &frameInList(const char *what, const Place &at) {
  Frame &call = frameInSchedule(what, at);
  if (!call.node->takesList)
    call.node->fail(call.bin, std::string("expected ") + what +
                                  " only in a stage that takes a list");
  return call;
}

template <class T> void emit(const T &value, int port, const Place &at) {
  Executor &running = executorAt("emit", at);
  if (const char *field = findUnwritten(value))
    running.frame->node->fail(running.frame->bin,
                              unwrittenText(field, typeName<T>()));
  running.emit(port, typeOf<T>(), &value);
}

/// Assigns those bins that a box of cells touches for which `touches` is true
/// of their place in the grid.
template <class F>
void assignBoxIf(const char *what, Cell lo, Cell hi, int rank, const Place &at,
                 F touches) {
  Executor &running = executorAt(what, at);
  const Grid &grid = running.expect(Phase::Assign, what).node->grid;
  Cell first{}, last{};
  for (int d = 0; d < 4; ++d) {
    lo[d] = d < rank ? std::max<int64_t>(lo[d], 0) : 0;
    hi[d] = d < rank ? std::min<int64_t>(hi[d], grid.domain[d] - 1) : 0;
    if (lo[d] > hi[d])
      return;
    first[d] = lo[d] / grid.size[d];
    last[d] = hi[d] / grid.size[d];
  }
  Cell b;
  for (b[3] = first[3]; b[3] <= last[3]; ++b[3])
    for (b[2] = first[2]; b[2] <= last[2]; ++b[2])
      for (b[1] = first[1]; b[1] <= last[1]; ++b[1])
        for (b[0] = first[0]; b[0] <= last[0]; ++b[0])
          if (touches(grid, b))
            running.assignBin(grid.bin(b));
}

inline void assignBox(const Cell &lo, const Cell &hi, int rank,
                      const Place &at) {
  assignBoxIf("assignToBoundingBox", lo, hi, rank, at,
              [](const Grid &, const Cell &) { return true; });
}

/// Whether the segment between the middles of two cells has a point of the bin
/// at a place in the grid, which is one of the box around both cells. Seen
/// along all other dimensions, the corners of the bin may not all be on one
/// side of the line, in any two. Lengths are doubled, so that middles are
/// integers.
inline bool touchesLine(const Grid &grid, const Cell &place, const Cell &a,
                        const Cell &b, int rank) {
  __extension__ typedef __int128 Wide;
  Wide along[4], offset[4], extent[4];
  for (int d = 0; d < rank; ++d) {
    int64_t lo = place[d] * grid.size[d];
    int64_t hi = std::min(lo + grid.size[d], grid.domain[d]);
    along[d] = b[d] - a[d];
    offset[d] = lo + hi - (2 * a[d] + 1);
    extent[d] = hi - lo;
  }
  auto magnitude = [](Wide n) { return n < 0 ? -n : n; };
  for (int d = 0; d < rank; ++d)
    for (int e = 0; e < d; ++e)
      if (magnitude(along[e] * offset[d] - along[d] * offset[e]) >
          magnitude(along[e]) * extent[d] + magnitude(along[d]) * extent[e])
        return false;
  return true;
}

inline void assignLine(const Cell &a, const Cell &b, int rank,
                       const Place &at) {
  Cell lo, hi;
  for (int d = 0; d < 4; ++d) {
    lo[d] = std::min(a[d], b[d]);
    hi[d] = std::max(a[d], b[d]);
  }
  assignBoxIf("assignToLine", lo, hi, rank, at,
              [&](const Grid &grid, const Cell &place) {
                return touchesLine(grid, place, a, b, rank);
              });
}

/// Fails if one of the positions of an assignment is NaN.
template <class V>
void expectNumbers(const char *what, const V &a, const V &b, const Place &at) {
  for (int d = 0; d < V::length(); ++d)
    if (a[d] != a[d] || b[d] != b[d])
      frameAt(what, at).node->fail(
          -1, "expected positions of numbers, but got NaN");
}

inline void checkOwnPixel(const Frame &call, const Cell &at, int rank) {
  Cell lo = call.node->grid.lo(call.bin);
  Cell hi = call.node->grid.hi(call.bin);
  for (int d = 0; d < rank; ++d)
    if (at[d] < lo[d] || at[d] >= hi[d])
      call.node->fail(call.bin,
                      "expected an update inside the stage's own bin, but "
                      "got pixel " +
                          toText(at, rank));
}

/// Positions that are floats name the cells of a domain that is not too large.
inline void checkExtent(const Frame &call) {
  for (int64_t cells : call.node->grid.domain)
    if (cells > detail::maxFloatExtent)
      call.node->fail(-1, "expected at most " +
                              std::to_string(detail::maxFloatExtent) +
                              " cells in each dimension where positions are "
                              "floats, but the domain has " +
                              std::to_string(cells));
}

inline int64_t currentIteration() {
  return Executor::current()->frame->loop->iteration;
}

/// Gathers one value of each iteration and hands out what `combine` makes of
/// them.
template <class T, class Result, class Combine>
Result collective(const char *what, const Place &at, const T &value,
                  Combine combine) {
  Executor &running = executorAt(what, at);
  Loop &loop = running.loopForSync(what);
  bool first = loop.iteration == 0;
  if (first)
    loop.slots = std::vector<T>(loop.size, value);
  else if (auto *slots = std::any_cast<std::vector<T>>(&loop.slots))
    (*slots)[loop.iteration] = value;
  running.sync({what, typeOf<Combine>()}); // fails unless all do the same
  if (first)                               // the first to go on
    loop.result = combine(std::any_cast<std::vector<T> &>(loop.slots));
  return std::any_cast<Result &>(loop.result);
}

/// In how many iterations the value is true.
inline int64_t countIterations(const char *what, bool value, const Place &at) {
  return collective<int64_t, int64_t>(
      what, at, value, [](const std::vector<int64_t> &values) {
        return std::count(values.begin(), values.end(), 1);
      });
}

/// How often f(0), ..., f(n - 1) is true.
template <class F>
int64_t countTrue(const char *what, int64_t n, F &f, const Place &at) {
  int64_t total = 0;
  frameOutsideLoop(what, at).parallelFor(
      n, [&](int64_t i) { total += bool(f(static_cast<int>(i))); });
  return total;
}

/// What a stage that uses a state holds, under a name that piko::Uses hides.
template <class State> class Uses {
public:
  State *state = nullptr; ///< set by the pipeline
};

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
  BinId
  binFromPosition(const Position<B::rank> &p,
                  reference::Place at = reference::Place::current()) const {
    const reference::Frame &call = reference::frameAt("binFromPosition", at);
    reference::checkExtent(call);
    return {call.node->grid.binAt(reference::toCell(p))};
  }
  BinId
  binFromPosition(const Cells<B::rank> &p,
                  reference::Place at = reference::Place::current()) const {
    return {reference::frameAt("binFromPosition", at)
                .node->grid.binAt(reference::toCell(p))};
  }
  /// The extent of the domain in cells.
  Cells<B::rank>
  domain(reference::Place at = reference::Place::current()) const {
    return reference::fromCell<B::rank>(
        reference::frameAt("domain", at).node->grid.domain);
  }

  // Schedule and Process.

  /// The bin that is scheduled or processed.
  BinId bin(reference::Place at = reference::Place::current()) const {
    return {reference::frameInBin("bin", at).bin};
  }
  /// Its first cell, and one past its last cell.
  Cells<B::rank>
  binLo(reference::Place at = reference::Place::current()) const {
    const reference::Frame &call = reference::frameInBin("binLo", at);
    return reference::fromCell<B::rank>(call.node->grid.lo(call.bin));
  }
  Cells<B::rank>
  binHi(reference::Place at = reference::Place::current()) const {
    const reference::Frame &call = reference::frameInBin("binHi", at);
    return reference::fromCell<B::rank>(call.node->grid.hi(call.bin));
  }

  // Positions and cells as braced lists of numbers.

  template <class T>
  BinId
  binFromPosition(const T (&p)[B::rank],
                  reference::Place at = reference::Place::current()) const {
    return binFromPosition(detail::pointOf(p), at);
  }
  template <class T>
  void assignToBoundingBox(const In &in, const T (&lo)[B::rank],
                           const T (&hi)[B::rank],
                           reference::Place at = reference::Place::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  template <class T>
  void assignToLine(const In &in, const T (&a)[B::rank], const T (&b)[B::rank],
                    reference::Place at = reference::Place::current()) {
    assignToLine(in, detail::pointOf(a), detail::pointOf(b), at);
  }

  // If they are of several types: floats.
  BinId
  binFromPosition(const float (&p)[B::rank],
                  reference::Place at = reference::Place::current()) const {
    return binFromPosition(detail::pointOf(p), at);
  }
  void assignToBoundingBox(const In &in, const float (&lo)[B::rank],
                           const float (&hi)[B::rank],
                           reference::Place at = reference::Place::current()) {
    assignToBoundingBox(in, detail::pointOf(lo), detail::pointOf(hi), at);
  }
  void assignToLine(const In &in, const float (&a)[B::rank],
                    const float (&b)[B::rank],
                    reference::Place at = reference::Place::current()) {
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

  void assignToBin(const In &, BinId bin,
                   reference::Place at = reference::Place::current()) {
    reference::executorAt("assignToBin", at).assignBin(bin.index);
  }
  void assignToAll(const In &,
                   reference::Place at = reference::Place::current()) {
    int64_t bins = reference::frameAt("assignToAll", at).node->grid.bins();
    for (int64_t bin = 0; bin < bins; ++bin)
      reference::executorAt("assignToAll", at).assignBin(bin);
  }
  /// To the bin in which the producer emitted it.
  void assignToPreviousBins(const In &,
                            reference::Place at = reference::Place::current()) {
    reference::Frame &call =
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
  void assignToBoundingBox(const In &, const Cells<B::rank> &lo,
                           const Cells<B::rank> &hi,
                           reference::Place at = reference::Place::current()) {
    reference::assignBox(reference::toCell(lo), reference::toCell(hi), B::rank,
                         at);
  }
  void assignToBoundingBox(const In &, const Position<B::rank> &lo,
                           const Position<B::rank> &hi,
                           reference::Place at = reference::Place::current()) {
    reference::expectNumbers("assignToBoundingBox", lo, hi, at);
    reference::assignBox(reference::toCell(lo), reference::toCell(hi), B::rank,
                         at);
  }
  /// To all bins that have a point of the segment from the middle of cell a to
  /// that of cell b.
  void assignToLine(const In &, const Cells<B::rank> &a,
                    const Cells<B::rank> &b,
                    reference::Place at = reference::Place::current()) {
    reference::assignLine(reference::toCell(a), reference::toCell(b), B::rank,
                          at);
  }
  void assignToLine(const In &, const Position<B::rank> &a,
                    const Position<B::rank> &b,
                    reference::Place at = reference::Place::current()) {
    reference::expectNumbers("assignToLine", a, b, at);
    reference::assignLine(reference::toCell(a), reference::toCell(b), B::rank,
                          at);
  }

  // Schedule.

  void specifySchedule(SchedulePolicy, int64_t tileSplit = 0,
                       reference::Place at = reference::Place::current()) {
    reference::Frame &call = reference::frameInSchedule("specifySchedule", at);
    if (tileSplit < 0)
      call.node->fail(call.bin,
                      "expected a tile split of at least 0, but got " +
                          std::to_string(tileSplit));
  }
  /// Waits until all stages of type X are finished.
  template <class X>
  void endStage(reference::Place at = reference::Place::current()) {
    reference::Node &node = *reference::frameInSchedule("endStage", at).node;
    const reference::TypeInfo *type = reference::typeOf<X>();
    if (std::find(node.waitsOn.begin(), node.waitsOn.end(), type) ==
        node.waitsOn.end())
      node.waitsOn.push_back(type);
  }
  /// Waits until nothing can reach this bin any more.
  void endBin(reference::Place at = reference::Place::current()) {
    reference::frameInSchedule("endBin", at).node->endsBin = true;
  }
  /// Calls a list Process with n primitives at a time.
  void batch(int64_t n, reference::Place at = reference::Place::current()) {
    reference::Frame &call = reference::frameInList("batch", at);
    if (n < 1)
      call.node->fail(call.bin, "expected a batch of at least 1, but got " +
                                    std::to_string(n));
    call.node->schedules[call.bin].batch = n;
  }
  /// Calls a list Process for empty bins, too.
  void everyBin(reference::Place at = reference::Place::current()) {
    reference::Frame &call = reference::frameInList("everyBin", at);
    call.node->schedules[call.bin].everyBin = true;
  }
  void specifyOrder(Order order,
                    reference::Place at = reference::Place::current()) {
    reference::frameInSchedule("specifyOrder", at).node->unordered =
        order == Unordered;
  }
  /// What lanes are given, instead of what the compiler chooses.
  void specifyLanes(Lanes, reference::Place at = reference::Place::current()) {
    reference::frameInSchedule("specifyLanes", at);
  }

  // Process.

  /// Sends a primitive through a port.
  void emit(const std::tuple_element_t<0, std::tuple<Out..., In>> &value,
            int port = 0, reference::Place at = reference::Place::current())
    requires(sizeof...(Out) > 0)
  {
    reference::emit(value, port, at);
  }
  template <class T>
  void emit(const T &value, int port = 0,
            reference::Place at = reference::Place::current()) {
    static_assert((std::is_same_v<T, Out> || ...),
                  "emit of a type that no port has");
    reference::emit(value, port, at);
  }

  /// Changes a pixel of the current bin: f(pixel). The calls for one pixel are
  /// in lineage order.
  template <class T, int R, class F>
  auto update(Image<T, R> &image, const Cells<R> &at, F &&f,
              reference::Place place = reference::Place::current()) {
    reference::Frame &call = reference::executorAt("update", place)
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
  void parallelFor(int64_t n, F &&f,
                   reference::Place at = reference::Place::current()) {
    static_assert(std::is_invocable_v<const std::remove_reference_t<F> &, int>,
                  "expected a function that can be called if it is const: "
                  "iterations share what it has captured by value");
    reference::executorAt("parallelFor", at).parallelFor(n, [&f](int64_t i) {
      f(static_cast<int>(i));
    });
  }
  /// Calls f(cell) for each cell of the current bin, x fastest.
  template <class F>
  void parallelForPixels(F &&f,
                         reference::Place at = reference::Place::current()) {
    Cells<B::rank> lo = binLo(at), hi = binHi(at) - 1;
    parallelForPixels(lo, hi, std::forward<F>(f), at);
  }
  /// The same for the cells of the closed box from lo to hi that lie in the
  /// bin.
  template <class F>
  void parallelForPixels(const Cells<B::rank> &lo, const Cells<B::rank> &hi,
                         F &&f,
                         reference::Place at = reference::Place::current()) {
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
  void parallelForPixels(int lo, int hi, F &&f,
                         reference::Place at = reference::Place::current()) {
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
  void sync(reference::Place at = reference::Place::current()) {
    reference::executorAt("sync", at).sync({"sync"});
  }

  // Over the iterations of the enclosing parallelFor; each of them is also a
  // sync(). Every iteration gets the result.

  bool any(bool value, reference::Place at = reference::Place::current()) {
    return reference::countIterations("any", value, at) != 0;
  }
  bool all(bool value, reference::Place at = reference::Place::current()) {
    return reference::countIterations("all", !value, at) == 0;
  }
  int64_t count(bool value, reference::Place at = reference::Place::current()) {
    return reference::countIterations("count", value, at);
  }
  /// op over all values, in a fixed binary tree.
  template <class T, class Op>
  T reduce(T value, Op op, reference::Place at = reference::Place::current()) {
    return reference::collective<T, T>(
        "reduce", at, value, [&](const std::vector<T> &v) {
          return reference::reduceTree(v, op, T{});
        });
  }
  /// op over the values of the iterations before this one; `empty` in the
  /// first.
  template <class T, class Op>
  T scan(T value, Op op, T empty = T{},
         reference::Place at = reference::Place::current()) {
    return reference::collective<T, std::vector<T>>(
        "scan", at, value, [&](const std::vector<T> &v) {
          return reference::scanTree(v, op, empty);
        })[reference::currentIteration()];
  }
  /// Iteration r gets the index of the iteration with the r-th smallest key.
  template <class K>
  int64_t sort(K key, reference::Place at = reference::Place::current()) {
    static_assert(std::is_arithmetic_v<K>, "the key of sort is a number");
    return reference::collective<K, std::vector<int64_t>>(
        "sort", at, key, [](const std::vector<K> &keys) {
          return reference::sortedIndices(keys);
        })[reference::currentIteration()];
  }

  // Over f(0), ..., f(n - 1), outside parallelFor.

  template <class F>
  bool any(int64_t n, F &&f,
           reference::Place at = reference::Place::current()) {
    return reference::countTrue("any(n, f)", n, f, at) != 0;
  }
  template <class F>
  bool all(int64_t n, F &&f,
           reference::Place at = reference::Place::current()) {
    return reference::countTrue("all(n, f)", n, f, at) == n;
  }
  template <class F>
  int64_t count(int64_t n, F &&f,
                reference::Place at = reference::Place::current()) {
    return reference::countTrue("count(n, f)", n, f, at);
  }
  template <class T, class F, class Op>
  T reduce(int64_t n, F &&f, Op op, T empty,
           reference::Place at = reference::Place::current()) {
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

#endif // PIKO_REFERENCE_STAGE_H
