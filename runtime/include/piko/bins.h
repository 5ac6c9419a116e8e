//===- piko/bins.h - Bins, directives and positions -----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The vocabulary that the reference executor and compiled pipelines share:
// bin ids, bin extents, the values of the schedule directives, and how a
// position becomes a cell. It includes no heavy standard header.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_BINS_H
#define PIKO_BINS_H

#if defined(__FAST_MATH__) ||                                                  \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ != 0)
#error "piko.h: pipelines cannot be compiled with -ffast-math"
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0 &&                \
    !defined(__PIKO__)
#error "piko.h: floats must be evaluated as floats (use SSE arithmetic)"
#endif
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

#include <stdint.h>

#include <glm/ext/vector_float1.hpp>
#include <glm/ext/vector_int1.hpp>
#include <glm/glm.hpp>

namespace piko {

/// The number of a bin in its stage's grid: row-major, x fastest; -1 is no
/// bin.
struct BinId {
  int64_t index = -1;

  friend constexpr bool operator==(BinId, BinId) = default;
};

/// The extent of a stage's bins in cells (pixels, voxels), one number for each
/// dimension of the domain; 0 is the whole domain. A pipeline has one to four
/// dimensions.
template <int... Size> struct Bins {
  static_assert(sizeof...(Size) >= 1 && sizeof...(Size) <= 4,
                "a grid of bins has one to four dimensions");
  static_assert(((Size >= 0) && ...), "a bin size is at least 0");
  static constexpr int rank = sizeof...(Size);
  static constexpr int64_t size[] = {Size...};
  static constexpr bool wholeDomain = ((Size == 0) && ...);
};

/// Which cores run the bins of a stage.
enum SchedulePolicy : int32_t {
  LoadBalance = 0, ///< any core takes the next bin
  DirectMap = 1,   ///< each core has bins of its own
  Serialize = 2,   ///< one core runs all bins
  All = 3,         ///< all cores run one bin after the other
};

/// In which order the primitives of a stage are processed, as far as the
/// program can tell.
enum Order : int32_t {
  InLineage = 0, ///< as the reference executor does
  Unordered = 1, ///< any
};

/// What a lane is given: of a vector, or a thread of a block.
enum class Lanes : int32_t {
  Items = 0,      ///< a primitive each
  Iterations = 1, ///< iterations of the parallel loops of one primitive or list
  Collapsed = 2,  ///< pairs of a primitive and an iteration
  One = 3,        ///< one lane does everything
};

/// How exactly the numbers of a Process are computed by a compiled pipeline.
enum class Precision : int32_t {
  Strict = 0,     ///< to the bit as the reference executor does
  Contracted = 1, ///< a * b + c may be rounded once
  Relaxed = 2,    ///< and divisions, roots and functions may be approximations
};

/// The primitives of one bin, or one batch of them, in order.
template <class T> class List;

/// The state of a pipeline that has none.
struct NoState {};

/// A position or a size in cells.
template <int Rank> using Cells = glm::vec<Rank, int, glm::defaultp>;
/// A position within the domain; cell c spans [c, c + 1).
template <int Rank> using Position = glm::vec<Rank, float, glm::defaultp>;

namespace detail {

template <class T, class U> inline constexpr bool isSame = false;
template <class T> inline constexpr bool isSame<T, T> = true;
template <class T, class...> struct First {
  using type = T;
};
template <class T> struct Identity {
  using type = T;
};

struct OnlyCell : Cells<1> {
  OnlyCell(int x) : Cells<1>(x) {}
  OnlyCell(const Cells<1> &at) : Cells<1>(at) {}
};
/// What a function takes as a cell: in one dimension a number will do.
template <int Rank> struct CellArgument {
  using type = Cells<Rank>;
};
template <> struct CellArgument<1> {
  using type = OnlyCell;
};

/// The most cells of a domain in a dimension where positions are floats, which
/// are exact so far, and the middles between them, too.
inline constexpr int64_t maxFloatExtent = int64_t(1) << 23;

/// The cell that holds the coordinate p, saturated; NaN is in no cell.
inline int32_t cellOf(float p) {
  float f = __builtin_floorf(p);
  if (!(f >= -2147483648.0f))
    return INT32_MIN;
  return f >= 2147483648.0f ? INT32_MAX : static_cast<int32_t>(f);
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

/// What a braced list of numbers means: cells, or a position if they have
/// fractions.
template <int Rank, class T> auto pointOf(const T (&numbers)[Rank]) {
  constexpr bool isInteger = T(1) / T(2) == T(0);
  static_assert(!isInteger || sizeof(T) <= sizeof(int),
                "expected cells of at most 32 bits");
  if constexpr (isInteger) {
    Cells<Rank> cells;
    for (int d = 0; d < Rank; ++d)
      cells[d] = static_cast<int>(numbers[d]);
    return cells;
  } else {
    Position<Rank> position;
    for (int d = 0; d < Rank; ++d)
      position[d] = static_cast<float>(numbers[d]);
    return position;
  }
}

} // namespace detail
} // namespace piko

#endif // PIKO_BINS_H
