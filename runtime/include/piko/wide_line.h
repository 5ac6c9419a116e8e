//===- piko/wide_line.h - Which bins a line with a width touches -*- C++
//-*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A line with a width is in those bins that its middle touches once they are
// grown by half of the width on all sides: so in all that a brush touches,
// round or square, which is drawn from one end to the other. Where the segment
// enters and leaves each dimension's slab says whether it has a point of all of
// them.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_WIDE_LINE_H
#define PIKO_WIDE_LINE_H

#include <piko/bins.h>

namespace piko::detail {

/// In doubles, which hold cells and floats exactly.
template <int Rank> class WideLine {
public:
  /// Cells are their middles, positions themselves. A width is at least 0.
  WideLine(const Cells<Rank> &a, const Cells<Rank> &b, float width)
      : half(width > 0 ? 0.5 * double(width) : 0) {
    for (int d = 0; d < Rank; ++d)
      setEnds(d, double(a[d]) + 0.5, double(b[d]) + 0.5);
  }
  WideLine(const Position<Rank> &a, const Position<Rank> &b, float width)
      : half(width > 0 ? 0.5 * double(width) : 0) {
    for (int d = 0; d < Rank; ++d)
      setEnds(d, double(a[d]), double(b[d]));
  }

  /// Calls f with the first cell of each bin of B that it touches.
  template <class B, class F>
  void forEachBin(const Cells<Rank> &domain, F f) const {
    int64_t first[Rank], count[Rank], bins = 1;
    for (int d = 0; d < Rank; ++d) {
      double low = from[d] < to[d] ? from[d] : to[d];
      double high = from[d] < to[d] ? to[d] : from[d];
      // A bin that ends where the line begins is touched.
      first[d] = (limit(low - half - 1, domain[d]) / size<B>(d, domain));
      count[d] =
          limit(high + half, domain[d]) / size<B>(d, domain) - first[d] + 1;
      bins *= count[d];
    }
    for (int64_t bin = 0; bin < bins; ++bin) {
      int64_t rest = bin, lo[Rank], hi[Rank];
      for (int d = 0; d < Rank; ++d) {
        lo[d] = (first[d] + rest % count[d]) * size<B>(d, domain);
        hi[d] = lo[d] + size<B>(d, domain);
        hi[d] = hi[d] < domain[d] ? hi[d] : domain[d];
        rest /= count[d];
      }
      if (touches(lo, hi))
        f(makeCells<Rank>([&](int d) { return static_cast<int>(lo[d]); }));
    }
  }

private:
  void setEnds(int d, double a, double b) {
    from[d] = saturate(a);
    to[d] = saturate(b);
  }
  static double saturate(double x) {
    return x < -0x1p31 ? -0x1p31 : x > 0x1p31 ? 0x1p31 : x;
  }
  /// A coordinate as a cell of the domain.
  static int64_t limit(double x, int extent) {
    if (!(x > 0))
      return 0;
    return x < extent ? static_cast<int64_t>(x) : extent - 1;
  }
  template <class B> static int64_t size(int d, const Cells<Rank> &domain) {
    return B::size[d] ? B::size[d] : domain[d];
  }

  bool touches(const int64_t (&lo)[Rank], const int64_t (&hi)[Rank]) const {
    double enter = 0, leave = 1;
    for (int d = 0; d < Rank; ++d) {
      double along = to[d] - from[d];
      double below = double(lo[d]) - half - from[d];
      double above = double(hi[d]) + half - from[d];
      if (along == 0) {
        if (below > 0 || above < 0)
          return false;
        continue;
      }
      double in = (along > 0 ? below : above) / along;
      double out = (along > 0 ? above : below) / along;
      enter = in > enter ? in : enter;
      leave = out < leave ? out : leave;
    }
    return enter <= leave + rounding;
  }

  /// What quotients may be off by, so that no bin is missed.
  static constexpr double rounding = 0x1p-48;
  double from[Rank], to[Rank], half;
};

} // namespace piko::detail

#endif // PIKO_WIDE_LINE_H
