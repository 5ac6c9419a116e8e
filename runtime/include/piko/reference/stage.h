//===- piko/reference/stage.h - Stages for the reference executor ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the calls of piko/stage.h do where any C++ compiler runs a pipeline.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_STAGE_H
#define PIKO_REFERENCE_STAGE_H

#include <piko/macros_begin.h>

#include <piko/label.h>
#include <piko/reference/calls.h>

#define PIKO_PORT_TYPES(T, Out) "emit of a type that no port has"
#define PIKO_DIMENSIONS(Bins, Got)                                             \
  "expected as many dimensions as the bins of the stage have"
#define PIKO_SAY(NAME, ...) ::piko::reference::Directives{at}.NAME(__VA_ARGS__)

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

/// What a schedule phase says at a place; see piko/markers.def.
struct Directives {
  void schedule(int32_t, int64_t tileSplit) {
    CallFrame &call = frameInSchedule("specifySchedule", at);
    if (tileSplit < 0)
      call.node->fail(call.bin,
                      "expected a tile split of at least 0, but got " +
                          std::to_string(tileSplit));
  }
  template <class S> void endStage() {
    Node &node = *frameInSchedule("endStage", at).node;
    const TypeInfo *type = typeOf<S>();
    if (std::find(node.waitsOn.begin(), node.waitsOn.end(), type) ==
        node.waitsOn.end())
      node.waitsOn.push_back(type);
  }
  void endBin() { frameInSchedule("endBin", at).node->endsBin = true; }
  void batch(int64_t n) {
    CallFrame &call = frameInList("batch", at);
    if (n < 1)
      call.node->fail(call.bin, "expected a batch of at least 1, but got " +
                                    std::to_string(n));
    call.node->schedules[call.bin].batch = n;
  }
  void everyBin() {
    CallFrame &call = frameInList("everyBin", at);
    call.node->schedules[call.bin].everyBin = true;
  }
  void order(int32_t order) {
    frameInSchedule("specifyOrder", at).node->unordered = order == Unordered;
  }
  void lanes(int32_t) { frameInSchedule("specifyLanes", at); }
  void precision(int32_t precision) {
    frameInSchedule("specifyPrecision", at).node->precision =
        static_cast<Precision>(precision);
  }

  void ulps(int64_t ulps) {
    CallFrame &call = frameInSchedule("specifyUlps", at);
    if (ulps < 1)
      call.node->fail(call.bin,
                      "expected a specifyUlps of at least 1, but got " +
                          std::to_string(ulps));
    call.node->ulps = ulps;
  }
  void name(const char *text) {
    CallFrame &call = frameInSchedule("specifyName", at);
    std::string &label = call.node->label;
    if (!detail::isLabel(text))
      call.node->fail(call.bin, detail::labelRule + std::string(text) + "'");
    if (!label.empty() && label != text)
      call.node->fail(call.bin, "expected one name of a stage, but got '" +
                                    label + "' and '" + text + "'");
    label = text;
  }

  SourcePlace at;
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

namespace detail {

using Place = reference::SourcePlace;

namespace call {

template <class In, class... Out> void enterStage(const void *stage) {
  static_assert(std::is_trivially_copyable_v<In> &&
                    (std::is_trivially_copyable_v<Out> && ...),
                "primitives must be trivially copyable");
  static_assert(alignof(In) <= alignof(std::max_align_t),
                "primitives cannot be over-aligned");
  if (auto *members = reference::membersUnderConstruction())
    members->push_back({stage, reference::typeOf<In>()});
}

// Queries.
template <int Rank> int64_t binAt(const Place &at, const Cells<Rank> &cell) {
  return reference::frameAt("binFromPosition", at)
      .node->grid.binAt(reference::toCell(cell));
}
inline void floatPosition(const Place &at) {
  reference::checkExtent(reference::frameAt("binFromPosition", at));
}
inline int64_t bin(const Place &at) {
  return reference::frameInBin("bin", at).bin;
}
template <int Rank> Cells<Rank> domain(const Place &at) {
  return reference::fromCell<Rank>(
      reference::frameAt("domain", at).node->grid.domain);
}
template <int Rank> Cells<Rank> binLo(const Place &at) {
  const reference::CallFrame &call = reference::frameInBin("binLo", at);
  return reference::fromCell<Rank>(call.node->grid.lo(call.bin));
}
template <int Rank> Cells<Rank> binHi(const Place &at) {
  const reference::CallFrame &call = reference::frameInBin("binHi", at);
  return reference::fromCell<Rank>(call.node->grid.hi(call.bin));
}

// AssignBin.
inline void assignBin(const Place &at, int64_t bin) {
  reference::executorAt("assignToBin", at).assignBin(bin);
}
inline void assignAll(const Place &at) {
  reference::Executor &running = reference::executorAt("assignToAll", at);
  int64_t bins = running.frame->node->grid.bins();
  for (int64_t bin = 0; bin < bins; ++bin)
    running.assignBin(bin);
}
inline void assignPrevious(const Place &at) {
  reference::Executor &running =
      reference::executorAt("assignToPreviousBins", at);
  const reference::CallFrame &call =
      running.expect(reference::Phase::Assign, "assignToPreviousBins");
  if (!call.producer)
    call.node->fail(-1, "expected a previous stage, but the primitive is a "
                        "source's");
  if (call.producer->grid.size != call.node->grid.size)
    call.node->fail(-1, "expected bins of the same size as those of stage '" +
                            std::string(call.producer->name()) + "'");
  running.assignBin(call.bin);
}
inline void assignNaN(const Place &at) {
  reference::frameAt("assignToBoundingBox", at)
      .node->fail(-1, "expected positions of numbers, but got NaN");
}
template <int Rank>
void assignBox(const Place &at, const Cells<Rank> &lo, const Cells<Rank> &hi) {
  reference::assignBox(reference::toCell(lo), reference::toCell(hi), Rank, at);
}
template <int Rank>
void assignLine(const Place &at, const Cells<Rank> &a, const Cells<Rank> &b) {
  reference::assignLine(reference::toCell(a), reference::toCell(b), Rank, at);
}

// Process.
template <class T> void emit(const Place &at, const T &value, int port) {
  reference::emit(value, port, at);
}

template <int Rank, class T, int R, class F>
auto update(const Place &at, Image<T, R> &image,
            const typename CellArgument<R>::type &cell, F &f) {
  reference::CallFrame &call = reference::executorAt("update", at)
                                   .expect(reference::Phase::Process, "update");
  if (call.updating)
    call.node->fail(call.bin, "expected an update outside an update");
  reference::checkOwnPixel(call, reference::toCell(cell), Rank);
  struct Updating {
    bool &flag;
    ~Updating() { flag = false; }
  } updating{call.updating};
  call.updating = true;
  return image.update(cell, at, f);
}

template <class F, class Argument> constexpr void expectConst() {
  static_assert(
      std::is_invocable_v<const std::remove_reference_t<F> &, Argument>,
      "expected a function that can be called if it is const: "
      "iterations share what it has captured by value");
}
template <class F> void parallelFor(const Place &at, int64_t n, F &f) {
  expectConst<F, int>();
  reference::executorAt("parallelFor", at).parallelFor(n, [&f](int64_t i) {
    f(static_cast<int>(i));
  });
}
template <int Rank, class F>
void parallelForCells(const Place &at, const Cells<Rank> &begin,
                      const Cells<Rank> &end, F &f) {
  expectConst<F, Cells<Rank> &>();
  reference::Cell first = reference::toCell(begin),
                  size = reference::toCell(end, 1);
  int64_t n = 1;
  for (int d = 0; d < Rank; ++d) {
    size[d] = std::max<int64_t>(size[d] - first[d], 0);
    n *= size[d];
  }
  reference::executorAt("parallelForPixels", at)
      .parallelFor(n, [&f, first, size](int64_t i) {
        Cells<Rank> cell;
        for (int d = 0; d < Rank; ++d) {
          cell[d] = static_cast<int>(first[d] + i % size[d]);
          i /= size[d];
        }
        f(cell);
      });
}
inline void sync(const Place &at) {
  reference::executorAt("sync", at).sync({"sync"});
}

// Barriers that exchange values.
inline int64_t count(const Place &at, const char *what, bool value) {
  return reference::countIterations(what, value, at);
}
template <class T, class Op>
T reduce(const Place &at, const T &value, const Op &op) {
  return reference::collective<T, T>("reduce", at, value,
                                     [&](const std::vector<T> &v) {
                                       return reference::reduceTree(v, op, T{});
                                     });
}
template <class T, class Op>
T scan(const Place &at, const T &value, const Op &op, const T &empty) {
  return reference::collective<T, std::vector<T>>(
      "scan", at, value, [&](const std::vector<T> &v) {
        return reference::scanTree(v, op, empty);
      })[reference::currentIteration()];
}
template <class K> int64_t sort(const Place &at, K key) {
  static_assert(std::is_arithmetic_v<K>, "the key of sort is a number");
  return reference::collective<K, std::vector<int64_t>>(
      "sort", at, key, [](const std::vector<K> &keys) {
        return reference::sortedIndices(keys);
      })[reference::currentIteration()];
}

// The same over f(0), ..., f(n - 1).
template <class F>
int64_t countTrue(const Place &at, const char *what, int64_t n, F &f) {
  return reference::countTrue(what, n, f, at);
}
template <class T, class F, class Op>
T reduceOver(const Place &at, int64_t n, F &f, const Op &op, const T &empty) {
  std::vector<T> values(n);
  reference::frameOutsideLoop("reduce(n, f)", at)
      .parallelFor(n, [&](int64_t i) { values[i] = f(static_cast<int>(i)); });
  return reference::reduceTree(std::move(values), op, empty);
}

} // namespace call
} // namespace detail

} // namespace piko

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_STAGE_H
