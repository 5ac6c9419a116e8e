//===- Expected.cpp - What the pipelines must give, computed by hand ------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Expected.h"

#include <algorithm>
#include <cmath>

namespace conformance {
namespace {

/// Bins of an extent over the domain.
struct Bins {
  Bins(int width, int height, int extent)
      : width(width), height(height), extent(extent),
        columns((width + extent - 1) / extent),
        rows((height + extent - 1) / extent) {}

  int count() const { return columns * rows; }
  int of(int x, int y) const { return y / extent * columns + x / extent; }
  /// Calls `f` with the bins that a box touches, in ascending order.
  template <class F>
  void forBox(int x0, int y0, int x1, int y1, const F &f) const {
    x0 = std::max(x0, 0), y0 = std::max(y0, 0);
    x1 = std::min(x1, width - 1), y1 = std::min(y1, height - 1);
    if (x0 > x1 || y0 > y1)
      return;
    for (int row = y0 / extent; row <= y1 / extent; ++row)
      for (int column = x0 / extent; column <= x1 / extent; ++column)
        f(row * columns + column);
  }

  int width, height, extent, columns, rows;
};

void drawDot(Traces &traces, const Dot &d) {
  for (int y = d.y; y <= d.y + 1; ++y)
    for (int x = d.x; x <= d.x + 2; ++x)
      if (traces.has(x, y))
        traces.at(x, y).add(d.value);
}

} // namespace

Traces expectJoins(int width, int height, int bias, const Dots &split,
                   const Dots &draw) {
  Traces traces(width, height);
  Bins bins(width, height, binExtent);
  for (const Dot &d : split)
    for (int i = 0; i < d.value % 4; ++i) {
      int value = d.value + i;
      if (value % 2 != 0)
        drawDot(traces, {d.x, d.y, value});
      else
        bins.forBox(d.x, d.y, d.x + 9, d.y + 4, [&](int bin) {
          drawDot(traces, {d.x, d.y, value + bias});
          drawDot(traces, {d.x + 2, d.y, bin});
        });
    }
  for (const Dot &d : draw)
    drawDot(traces, d);
  return traces;
}

/// Every hop, or every `stride`th one, from number `hops` on.
static void walk(Traces &traces, int sign, int bias, const Walker &w,
                 int stride = 1, int hops = 0) {
  if (hops % stride == 0)
    traces.at(w.x, w.y).add(sign * w.value);
  if (w.left == 0)
    return;
  Walker next = hop(w, traces.width, traces.height);
  walk(traces, sign, bias, next, stride, hops + 1);
  if (w.value % 3 == 0 && w.left > 1)
    walk(traces, sign, bias, {next.x, next.y, next.value + bias, next.left - 1},
         stride, hops + 1);
}

Traces expectWalk(int width, int height, int bias, const Walkers &walkers) {
  Traces traces(width, height);
  for (const Walker &w : walkers)
    walk(traces, 1, bias, w);
  return traces;
}

Traces expectPassed(int width, int height, int bias, const Walkers &walkers) {
  Traces traces(width, height);
  for (const Walker &w : walkers)
    walk(traces, -1, bias, w);
  return traces;
}

Traces expectCrossed(int width, int height, int bias, const Walkers &walkers,
                     const Walkers &others) {
  Traces traces(width, height);
  for (const Walker &w : walkers)
    walk(traces, -1, bias, w, 2);
  for (const Walker &w : others)
    walk(traces, -1, bias, w, 2, 1);
  return traces;
}

Traces expectRounds(int width, int height, const Walkers &walkers) {
  Traces traces(width, height);
  Bins bins(width, height, 16);
  for (Walkers now = walkers, later; !now.empty(); now.swap(later)) {
    later.clear();
    for (int bin = 0; bin < bins.count(); ++bin) {
      Walkers list;
      for (const Walker &w : now)
        if (bins.of(w.x, w.y) == bin)
          list.push_back(w);
      auto sum = static_cast<uint32_t>(list.size());
      for (const Walker &w : list)
        sum += static_cast<uint32_t>(w.value);
      for (const Walker &w : list) {
        traces.at(w.x, w.y).add(w.value ^ static_cast<int32_t>(sum));
        if (w.left > 0)
          later.push_back(hop(w, width, height));
      }
    }
  }
  return traces;
}

Traces expectSchedules(int width, int height, const Dots &dots) {
  Traces traces(width, height);
  Bins large(width, height, 16), small(width, height, binExtent);
  std::vector<Dots> lists(static_cast<size_t>(small.count()));
  auto keep = [&](const Dot &d) {
    lists[static_cast<size_t>(small.of(d.x, d.y))].push_back(
        {d.x, d.y, d.value + 1});
  };
  for (const Dot &d : dots)
    large.forBox(d.x, d.y, d.x + 9, d.y, [&](int bin) {
      Dot next{d.x, d.y, d.value * 2 + bin};
      keep(next);
      if (next.value % 5 == 0)
        keep({d.x, d.y, -next.value});
    });
  for (int bin = 0; bin < small.count(); ++bin) {
    const Dots &list = lists[static_cast<size_t>(bin)];
    Trace &corner = traces.at(bin % small.columns * binExtent,
                              bin / small.columns * binExtent);
    if (list.empty())
      corner.add(0);
    for (size_t i = 0; i < list.size(); ++i) {
      if (i % batchSize == 0)
        corner.add(
            static_cast<int32_t>(std::min<size_t>(batchSize, list.size() - i)));
      traces.at(list[i].x, list[i].y).add(list[i].value);
    }
  }
  return traces;
}

Traces expectPolicies(int width, int height, const Dots &dots) {
  Traces traces(width, height);
  Bins bins(width, height, binExtent);
  for (const Dot &d : dots)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (bins.of(x, y) == d.value)
          traces.at(x, y).add(d.x);
  return traces;
}

FrameResult expectFrame(int width, int height, int scale,
                        const std::vector<int32_t> &table,
                        std::vector<int32_t> sums, const Items &items,
                        const std::vector<int32_t> &finds) {
  FrameResult result{std::move(sums),
                     {},
                     Items(items.size(), Item{0, 0, 0, 0, 0}),
                     {width, height},
                     {width, height}};
  for (const Item &item : items) {
    auto index = static_cast<size_t>(item.index);
    result.sums[index % result.sums.size()] +=
        table[static_cast<size_t>(item.kind)] * scale;
    if (item.kind != 0)
      result.kept[index] = item;
    int x = static_cast<int>(std::floor(item.x)),
        y = static_cast<int>(std::floor(item.y));
    if (!result.nearest.has(x, y) || item.z >= result.nearest.at(x, y).z)
      continue;
    result.nearest.at(x, y) = {item.z, item.index};
    ++result.touched.at(x, y);
  }
  for (int32_t i : finds) {
    auto index = static_cast<size_t>(i);
    result.found.resize(std::max(result.found.size(), index + 1));
    result.found[index] = result.sums[index % result.sums.size()] + i;
  }
  return result;
}

} // namespace conformance
