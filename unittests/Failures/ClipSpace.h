//===- ClipSpace.h - Triangles in clip space, drawn and exact ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The exact answer is found without projecting a corner: a pixel's centre is a
// combination of the three corners in homogeneous coordinates, whose weights
// are all positive where the triangle is seen (Olano and Greer 1997).
//
//===----------------------------------------------------------------------===//
#ifndef UNITTESTS_FAILURES_CLIPSPACE_H
#define UNITTESTS_FAILURES_CLIPSPACE_H

#include "Failure.h"

#include "ClippedTriangles.h"
#include "DividedTriangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace failures::clipspace {

using Triangle = pipelines::ClippedTriangles::ClipTriangle;

/// Part of an image of size x size pixels.
struct Window {
  int size, left, top, width, height;

  explicit Window(int size) : Window{size, 0, 0, size, size} {}
  Window(int size, int left, int top, int width, int height)
      : size(size), left(left), top(top), width(width), height(height) {}
};

/// What pixels show: the number of a triangle, or one of these.
using Shown = std::vector<int>;
enum : int { nothing = -1, several = -2, unclear = -3 };

template <class Pipe>
Shown drawTriangles(const std::vector<Triangle> &triangles, const Window &w) {
  Pipe pipe;
  pipe.setDomain({w.width, w.height});
  pipe.state().size = {w.size, w.size};
  pipe.state().origin = {w.left, w.top};
  pipe.feed(0, static_cast<const void *>(triangles.data()),
            int64_t(triangles.size()));
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  Shown shown;
  for (int y = 0; y < w.height; ++y)
    for (int x = 0; x < w.width; ++x)
      shown.push_back(image(x, y).draws > 1 ? several : image(x, y).triangle);
  return shown;
}

/// A triangle as seen by pixels' centres.
class Seen {
public:
  Seen(const Triangle &t, int size) : scale(2.0L / size) {
    Row rows[3] = {rowOf(t.a), rowOf(t.b), rowOf(t.c)};
    const glm::vec4 *corners[3] = {&t.a, &t.b, &t.c};
    for (int i = 0; i < 3; ++i)
      lines[i] = cross(rows[(i + 1) % 3], rows[(i + 2) % 3]);
    long double volume = dot(rows[0], lines[0]);
    isEdgeOn = volume == 0;
    for (int i = 0; i < 3; ++i) {
      lines[i] = lines[i] * (1 / volume);
      lines[3] =
          lines[3] + lines[i] * ((long double)corners[i]->z + corners[i]->w);
    }
  }

  /// How many pixels the nearest border is away from the centre of a pixel,
  /// negative outside. The fourth line is the near plane.
  double depthInside(int x, int y) const {
    if (isEdgeOn)
      return -std::numeric_limits<double>::infinity();
    Row at = {(x + 0.5L) * scale - 1, 1 - (y + 0.5L) * scale, 1};
    long double least = std::numeric_limits<long double>::infinity();
    for (const Row &line : lines) {
      long double slope = scale * std::hypot(line.x, line.y);
      long double value = dot(at, line);
      // One without a slope is the same for all pixels.
      long double away = slope > 0 ? value / slope : value >= 0 ? 1e9L : -1e9L;
      least = std::min(least, away);
    }
    return double(least);
  }

private:
  struct Row {
    long double x = 0, y = 0, w = 0;
    Row operator*(long double s) const { return {x * s, y * s, w * s}; }
    Row operator+(const Row &o) const { return {x + o.x, y + o.y, w + o.w}; }
  };
  static Row rowOf(glm::vec4 v) { return {v.x, v.y, v.w}; }
  static long double dot(const Row &a, const Row &b) {
    return a.x * b.x + a.y * b.y + a.w * b.w;
  }
  static Row cross(const Row &a, const Row &b) {
    return {a.y * b.w - a.w * b.y, a.w * b.x - a.x * b.w,
            a.x * b.y - a.y * b.x};
  }

  Row lines[4];
  long double scale;
  bool isEdgeOn;
};

/// What pixels show of triangles that do not overlap; unclear less than so many
/// pixels from a border.
inline Shown findExact(const std::vector<Triangle> &triangles, const Window &w,
                       double border) {
  Shown shown(size_t(w.width) * w.height, nothing);
  for (const Triangle &t : triangles) {
    Seen seen(t, w.size);
    for (int y = 0; y < w.height; ++y)
      for (int x = 0; x < w.width; ++x) {
        double inside = seen.depthInside(x + w.left, y + w.top);
        if (std::abs(inside) < border)
          shown[size_t(y) * w.width + x] = unclear;
        else if (inside > 0)
          shown[size_t(y) * w.width + x] = t.index;
      }
  }
  return shown;
}

/// In percent; unclear ones may be anything, but drawn once at most.
inline double percentWrong(const Shown &shown, const Shown &exact) {
  double wrong = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    wrong += exact[i] == unclear ? shown[i] == several : shown[i] != exact[i];
  return 100 * wrong / double(exact.size());
}

inline Errors compare(const std::vector<Triangle> &triangles, const Window &w,
                      double border) {
  Shown exact = findExact(triangles, w, border);
  return {percentWrong(drawTriangles<pipelines::DividedTriangles>(triangles, w),
                       exact),
          percentWrong(drawTriangles<pipelines::ClippedTriangles>(triangles, w),
                       exact)};
}

/// Neighbours in different shades; what is drawn several times in red.
inline Image show(const Shown &shown, int size) {
  return paint(size, size, [&](int x, int y) {
    int triangle = shown[y * size + x];
    if (triangle == several)
      return rgb(1, 0.2f, 0.1f);
    if (triangle < 0)
      return rgb(0, 0, 0);
    float shade = triangle / 2 % 2 ? 0.9f : 0.6f;
    return rgb(0.4f * shade, shade, 0.8f * shade);
  });
}

inline Pictures drawBoth(const std::vector<Triangle> &triangles, int size) {
  Window w(size);
  return {show(drawTriangles<pipelines::DividedTriangles>(triangles, w), size),
          show(drawTriangles<pipelines::ClippedTriangles>(triangles, w), size)};
}

} // namespace failures::clipspace

#endif // UNITTESTS_FAILURES_CLIPSPACE_H
