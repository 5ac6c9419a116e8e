//===- piko/reference/calls.h - What the calls of a stage do --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage's phases find no names but those of the language, so that these are
// no members.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_REFERENCE_CALLS_H
#define PIKO_REFERENCE_CALLS_H

#include <piko/macros_begin.h>

#include <piko/reference/atomics.h>
#include <piko/reference/collectives.h>

namespace piko::reference {

/// The executor, which is at a call of the language.
inline Executor &executorAt(const char *what, const SourcePlace &at) {
  Executor *running = Executor::current();
  if (!running || !running->frame)
    throw Error(std::string(what) + " outside a running pipeline");
  running->frame->at = at;
  return *running;
}
/// The same, outside parallelFor.
inline Executor &frameOutsideLoop(const char *what, const SourcePlace &at) {
  Executor &running = executorAt(what, at);
  const CallFrame &call = *running.frame;
  if (call.loop)
    call.node->fail(call.bin,
                    std::string("expected ") + what + " outside a parallelFor");
  return running;
}
inline CallFrame &frameAt(const char *what, const SourcePlace &at) {
  return *executorAt(what, at).frame;
}
inline CallFrame &frameInBin(const char *what, const SourcePlace &at) {
  CallFrame &call = frameAt(what, at);
  if (call.phase == Phase::Assign)
    call.node->fail(-1, std::string(what) + " in assignBin");
  return call;
}
inline CallFrame &frameInSchedule(const char *what, const SourcePlace &at) {
  return executorAt(what, at).expect(Phase::Schedule, what);
}
inline CallFrame &frameInList(const char *what, const SourcePlace &at) {
  CallFrame &call = frameInSchedule(what, at);
  if (!call.node->takesList)
    call.node->fail(call.bin, std::string("expected ") + what +
                                  " only in a stage that takes a list");
  return call;
}

template <class T> void emit(const T &value, int port, const SourcePlace &at) {
  Executor &running = executorAt("emit", at);
  if (const char *field = findUnwritten(value))
    running.frame->node->fail(running.frame->bin,
                              unwrittenText(field, typeName<T>()));
  running.emit(port, typeOf<T>(), &value);
}

/// Assigns those bins that a box of cells touches for which `touches` is true
/// of their place in the grid.
template <class F>
void assignBoxIf(const char *what, Cell lo, Cell hi, int rank,
                 const SourcePlace &at, F touches) {
  Executor &running = executorAt(what, at);
  const BinGrid &grid = running.expect(Phase::Assign, what).node->grid;
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
                      const SourcePlace &at) {
  assignBoxIf("assignToBoundingBox", lo, hi, rank, at,
              [](const BinGrid &, const Cell &) { return true; });
}

/// Whether the segment between the middles of two cells has a point of the bin
/// at a place in the grid, which is one of the box around both cells. Seen
/// along all other dimensions, the corners of the bin may not all be on one
/// side of the line, in any two. Lengths are doubled, so that middles are
/// integers.
inline bool touchesLine(const BinGrid &grid, const Cell &place, const Cell &a,
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
                       const SourcePlace &at) {
  Cell lo, hi;
  for (int d = 0; d < 4; ++d) {
    lo[d] = std::min(a[d], b[d]);
    hi[d] = std::max(a[d], b[d]);
  }
  assignBoxIf("assignToLine", lo, hi, rank, at,
              [&](const BinGrid &grid, const Cell &place) {
                return touchesLine(grid, place, a, b, rank);
              });
}

/// The last cell before one that is past it in each dimension.
inline Cell lastOf(Cell end) {
  for (int64_t &at : end)
    --at;
  return end;
}

inline void checkOwnPixel(const CallFrame &call, const Cell &at, int rank) {
  Cell lo = call.node->grid.lo(call.bin);
  Cell hi = call.node->grid.hi(call.bin);
  for (int d = 0; d < rank; ++d)
    if (at[d] < lo[d] || at[d] >= hi[d])
      call.node->fail(call.bin,
                      "expected an update inside the stage's own bin, but "
                      "got pixel " +
                          toText(at, rank) + "; the bin has " +
                          toText(lo, rank) + " to " + toText(lastOf(hi), rank));
}

/// Positions that are floats name the cells of a domain that is not too large.
inline void checkExtent(const CallFrame &call) {
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
Result collective(const char *what, const SourcePlace &at, const T &value,
                  Combine combine) {
  Executor &running = executorAt(what, at);
  HopLoop &loop = running.loopForSync(what);
  bool first = loop.iteration == 0;
  if (first)
    loop.handedIn = std::vector<T>(loop.size, value);
  else if (auto *values = std::any_cast<std::vector<T>>(&loop.handedIn))
    (*values)[loop.iteration] = value;
  running.sync({what, typeOf<Combine>()}); // fails unless all do the same
  if (first)                               // the first to go on
    loop.result = combine(std::any_cast<std::vector<T> &>(loop.handedIn));
  return std::any_cast<Result &>(loop.result);
}

/// In how many iterations the value is true.
inline int64_t countIterations(const char *what, bool value,
                               const SourcePlace &at) {
  return collective<int64_t, int64_t>(
      what, at, value, [](const std::vector<int64_t> &values) {
        return std::count(values.begin(), values.end(), 1);
      });
}

/// How often f(0), ..., f(n - 1) is true.
template <class F>
int64_t countTrue(const char *what, int64_t n, F &f, const SourcePlace &at) {
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

} // namespace piko::reference

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_CALLS_H
