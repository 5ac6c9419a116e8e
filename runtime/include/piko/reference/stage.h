//===- piko/reference/stage.h - What a stage's phases can say -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_STAGE_H
#define PIKO_REFERENCE_STAGE_H

#include <piko/reference/atomics.h>
#include <piko/reference/collectives.h>

#include <tuple>

namespace piko {

template <class State> class Pipe;

/// The primitives that a list Process is called with.
template <class T> class List {
public:
  List(const T *primitives, int64_t count)
      : primitives(primitives), count(count) {}

  int64_t size() const { return count; }
  const T &operator[](int64_t i) const {
    if (i < 0 || i >= count)
      reference::failAccess("expected a list index in [0, " +
                            std::to_string(count) + "), but got " +
                            std::to_string(i));
    return primitives[i];
  }
  const T *begin() const { return primitives; }
  const T *end() const { return primitives + count; }

private:
  const T *primitives;
  int64_t count;
};

/// The second base of a stage that uses the pipeline's state.
template <class State> class Uses {
public:
  State &state() const {
    if (!bound)
      throw Error("state() of a stage that is in no pipeline");
    return *bound;
  }

private:
  template <class> friend class Pipe;
  State *bound = nullptr;
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

  static constexpr int rank = B::rank;
  using FirstOut = std::tuple_element_t<0, std::tuple<Out..., In>>;

public:
  // Any phase.

  /// The bin that holds a position or a cell; BinId{-1} outside the domain.
  BinId binFromPosition(const Position<rank> &p) const {
    return {here("binFromPosition").node->grid.binAt(reference::toCell(p))};
  }
  BinId binFromPosition(const Cells<rank> &p) const {
    return {here("binFromPosition").node->grid.binAt(reference::toCell(p))};
  }
  /// The extent of the domain in cells.
  Cells<rank> domain() const {
    return reference::fromCell<rank>(here("domain").node->grid.domain);
  }

  // Schedule and Process.

  /// The bin that is scheduled or processed.
  BinId bin() const { return {inBin("bin").bin}; }
  /// Its first cell, and one past its last cell.
  Cells<rank> binLo() const {
    const reference::Frame &call = inBin("binLo");
    return reference::fromCell<rank>(call.node->grid.lo(call.bin));
  }
  Cells<rank> binHi() const {
    const reference::Frame &call = inBin("binHi");
    return reference::fromCell<rank>(call.node->grid.hi(call.bin));
  }

  // AssignBin. A primitive goes to the set of all bins that are named.

  void assignToBin(const In &, BinId bin) {
    executor("assignToBin").assignBin(bin.index);
  }
  void assignToAll(const In &) {
    int64_t bins = here("assignToAll").node->grid.bins();
    for (int64_t bin = 0; bin < bins; ++bin)
      executor("assignToAll").assignBin(bin);
  }
  /// To the bin in which the producer emitted it.
  void assignToPreviousBins(const In &) {
    reference::Frame &call =
        executor("assignToPreviousBins")
            .expect(reference::Phase::Assign, "assignToPreviousBins");
    if (!call.producer)
      call.node->fail(-1, "assignToPreviousBins of a primitive from a source");
    if (call.producer->grid.size != call.node->grid.size)
      call.node->fail(-1, "assignToPreviousBins needs the bin size of stage '" +
                              std::string(call.producer->name()) + "'");
    executor("assignToPreviousBins").assignBin(call.bin);
  }
  /// To all bins that a closed box of cells touches; outside the domain there
  /// are none.
  void assignToBoundingBox(const In &, const Cells<rank> &lo,
                           const Cells<rank> &hi) {
    assignBox(reference::toCell(lo), reference::toCell(hi));
  }
  void assignToBoundingBox(const In &, const Position<rank> &lo,
                           const Position<rank> &hi) {
    for (int d = 0; d < rank; ++d)
      if (lo[d] != lo[d] || hi[d] != hi[d])
        here("assignToBoundingBox").node->fail(-1, "a bounding box is NaN");
    assignBox(reference::toCell(lo), reference::toCell(hi));
  }

  // Schedule.

  void specifySchedule(SchedulePolicy, int64_t tileSplit = 0) {
    reference::Frame &call = inSchedule("specifySchedule");
    if (tileSplit < 0)
      call.node->fail(call.bin,
                      "expected a tile split of at least 0, but got " +
                          std::to_string(tileSplit));
  }
  /// Waits until all stages of type X are finished.
  template <class X> void endStage() {
    reference::Node &node = *inSchedule("endStage").node;
    node.waits = true;
    const reference::TypeInfo *type = reference::typeOf<X>();
    if (std::find(node.waitsOn.begin(), node.waitsOn.end(), type) ==
        node.waitsOn.end())
      node.waitsOn.push_back(type);
  }
  /// Waits until nothing can reach this bin any more.
  void endBin() { inSchedule("endBin").node->waits = true; }
  /// Calls a list Process with n primitives at a time.
  void batch(int64_t n) {
    reference::Frame &call = inList("batch");
    if (n < 1)
      call.node->fail(call.bin, "expected a batch of at least 1, but got " +
                                    std::to_string(n));
    call.node->schedules[call.bin].batch = n;
  }
  /// Calls a list Process for empty bins, too.
  void everyBin() {
    reference::Frame &call = inList("everyBin");
    call.node->schedules[call.bin].everyBin = true;
  }
  void specifyOrder(Order order) {
    inSchedule("specifyOrder").node->unordered = order == Unordered;
  }

  // Process.

  /// Sends a primitive through a port.
  void emit(const FirstOut &value, int port = 0)
    requires(sizeof...(Out) > 0)
  {
    emitAs(value, port);
  }
  template <class T> void emit(const T &value, int port = 0) {
    static_assert((std::is_same_v<T, Out> || ...),
                  "emit of a type that no port has");
    emitAs(value, port);
  }

  /// Changes a pixel of the current bin: f(pixel). The calls for one pixel are
  /// in lineage order.
  template <class T, int R, class F>
  auto update(Image<T, R> &image, const Cells<R> &at, F &&f) {
    reference::Frame &call =
        executor("update").expect(reference::Phase::Process, "update");
    checkOwnPixel(call, reference::toCell(at));
    struct Updating {
      bool &flag, saved;
      ~Updating() { flag = saved; }
    } updating{call.updating, call.updating};
    call.updating = true;
    return f(image.pixel(at));
  }

  /// Calls f(0), ..., f(n - 1), which are independent of one another.
  template <class F> void parallelFor(int64_t n, F &&f) {
    executor("parallelFor").parallelFor(n, [&f](int64_t i) {
      f(static_cast<int>(i));
    });
  }
  /// Calls f(cell) for each cell of the current bin, x fastest.
  template <class F> void parallelForPixels(F &&f) {
    reference::Cell lo = reference::toCell(binLo());
    reference::Cell hi = reference::toCell(binHi(), 1);
    int64_t n = 1;
    for (int d = 0; d < rank; ++d)
      n *= hi[d] - lo[d];
    executor("parallelForPixels").parallelFor(n, [&, lo, hi](int64_t i) {
      Cells<rank> cell;
      for (int d = 0; d < rank; ++d) {
        cell[d] = static_cast<int>(lo[d] + i % (hi[d] - lo[d]));
        i /= hi[d] - lo[d];
      }
      f(cell);
    });
  }
  /// In an iteration of parallelFor: a barrier between all iterations.
  void sync() { executor("sync()").sync(); }

  // Over the iterations of the enclosing parallelFor; each of them is also a
  // sync(). Every iteration gets the result.

  bool any(bool value) { return count(value) != 0; }
  bool all(bool value) { return count(!value) == 0; }
  int64_t count(bool value) {
    return reduce(int64_t(value), [](int64_t a, int64_t b) { return a + b; });
  }
  /// op over all values, in a fixed binary tree.
  template <class T, class Op> T reduce(T value, Op op) {
    return collective<T, T>("reduce", value, [&](const std::vector<T> &v) {
      return reference::reduceTree(v, op, T{});
    });
  }
  /// op over the values of the iterations before this one; `empty` in the
  /// first.
  template <class T, class Op> T scan(T value, Op op, T empty = T{}) {
    return collective<T, std::vector<T>>(
        "scan", value, [&](const std::vector<T> &v) {
          return reference::scanTree(v, op, empty);
        })[iteration()];
  }
  /// Iteration r gets the index of the iteration with the r-th smallest key.
  template <class K> int64_t sort(K key) {
    return collective<K, std::vector<int64_t>>(
        "sort", key, [](const std::vector<K> &keys) {
          return reference::sortedIndices(keys);
        })[iteration()];
  }

  // Over f(0), ..., f(n - 1), outside parallelFor.

  template <class F> bool any(int64_t n, F &&f) { return count(n, f) != 0; }
  template <class F> bool all(int64_t n, F &&f) { return count(n, f) == n; }
  template <class F> int64_t count(int64_t n, F &&f) {
    int64_t total = 0;
    parallelFor(n, [&](int i) { total += bool(f(i)); });
    return total;
  }
  template <class T, class F, class Op>
  T reduce(int64_t n, F &&f, Op op, T empty) {
    return reference::reduceTree(evaluate<T>(n, f), op, empty);
  }

private:
  template <class> friend class Pipe;
  reference::Node *node = nullptr; ///< set by the pipeline

  reference::Executor &executor(const char *what) const {
    reference::Executor *running = reference::Executor::current();
    if (!running || !running->frame)
      throw Error(std::string(what) + " outside a running pipeline");
    return *running;
  }
  reference::Frame &here(const char *what) const {
    return *executor(what).frame;
  }
  reference::Frame &inBin(const char *what) const {
    reference::Frame &call = here(what);
    if (call.phase == reference::Phase::Assign)
      call.node->fail(-1, std::string(what) + " in assignBin");
    return call;
  }
  reference::Frame &inSchedule(const char *what) const {
    return executor(what).expect(reference::Phase::Schedule, what);
  }
  reference::Frame &inList(const char *what) const {
    reference::Frame &call = inSchedule(what);
    if (!call.node->takesList)
      call.node->fail(call.bin,
                      std::string(what) + " needs a process that takes a list");
    return call;
  }

  template <class T> void emitAs(const T &value, int port) {
    executor("emit").emit(port, reference::typeOf<T>(), &value);
  }

  void assignBox(reference::Cell lo, reference::Cell hi) {
    reference::Executor &running = executor("assignToBoundingBox");
    const reference::Grid &grid =
        running.expect(reference::Phase::Assign, "assignToBoundingBox")
            .node->grid;
    reference::Cell first{}, last{};
    for (int d = 0; d < 4; ++d) {
      lo[d] = d < rank ? std::max<int64_t>(lo[d], 0) : 0;
      hi[d] = d < rank ? std::min<int64_t>(hi[d], grid.domain[d] - 1) : 0;
      if (lo[d] > hi[d])
        return;
      first[d] = lo[d] / grid.size[d];
      last[d] = hi[d] / grid.size[d];
    }
    reference::Cell b;
    for (b[3] = first[3]; b[3] <= last[3]; ++b[3])
      for (b[2] = first[2]; b[2] <= last[2]; ++b[2])
        for (b[1] = first[1]; b[1] <= last[1]; ++b[1])
          for (b[0] = first[0]; b[0] <= last[0]; ++b[0])
            running.assignBin(grid.bin(b));
  }

  static void checkOwnPixel(const reference::Frame &call,
                            const reference::Cell &at) {
    reference::Cell lo = call.node->grid.lo(call.bin);
    reference::Cell hi = call.node->grid.hi(call.bin);
    for (int d = 0; d < rank; ++d)
      if (at[d] < lo[d] || at[d] >= hi[d])
        call.node->fail(call.bin,
                        "update of pixel " + reference::toText(at, rank) +
                            " outside the bin, whose pixels are " +
                            reference::toText(lo, rank) + " to " +
                            reference::toText(hi, rank) + " (exclusive)");
  }

  int64_t iteration() const { return here("parallelFor").loop->iteration; }

  /// Gathers one value of each iteration and hands out what `combine` makes of
  /// them.
  template <class T, class Result, class Combine>
  Result collective(const char *what, const T &value, Combine combine) {
    reference::Loop &loop = executor(what).loopForSync(what);
    bool first = loop.iteration == 0;
    if (first)
      loop.slots = std::vector<T>(loop.size, value);
    else
      std::any_cast<std::vector<T> &>(loop.slots)[loop.iteration] = value;
    sync();
    if (first) // the first to go on
      loop.result = combine(std::any_cast<std::vector<T> &>(loop.slots));
    return std::any_cast<Result &>(loop.result);
  }

  template <class T, class F> std::vector<T> evaluate(int64_t n, F &f) {
    std::vector<T> values(n);
    parallelFor(n, [&](int i) { values[i] = f(i); });
    return values;
  }
};

/// A stage with two-dimensional bins of X by Y cells.
template <int X, int Y, int Threads, class In, class... Out>
using Stage = BasicStage<Bins<X, Y>, Threads, In, Out...>;

} // namespace piko

#endif // PIKO_REFERENCE_STAGE_H
