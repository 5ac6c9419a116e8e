//===- FineTessellation.h - What patches cover, by brute force ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_EXAMPLES_FINETESSELLATION_H
#define PIKO_UNITTESTS_EXAMPLES_FINETESSELLATION_H

#include <piko/scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace piko {

/// Patches, uniformly and far more finely diced than pixels, in double
/// precision: the least depth at the middle of each pixel.
class FineTessellation {
public:
  FineTessellation(const scene::Camera &camera, int width, int height)
      : toClip(camera.viewProjection), width(width), height(height),
        depths(size_t(width) * height, infinity) {}

  /// Adds a patch as `cells` by `cells` quadrilaterals.
  void add(const scene::Patch &patch, int cells) {
    std::vector<glm::dvec4> corners;
    for (int i = 0; i <= cells; ++i)
      for (int j = 0; j <= cells; ++j)
        corners.push_back(toClip * glm::dvec4(pointOf(patch, double(i) / cells,
                                                      double(j) / cells),
                                              1));
    int side = cells + 1;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        const glm::dvec4 *c = &corners[size_t(i) * side + j];
        draw(c[0], c[side], c[side + 1]);
        draw(c[0], c[side + 1], c[1]);
      }
  }

  /// Counts the pixels of a picture that a crack shows in: the tessellation
  /// covers them and all around them, but the picture has nothing there, or
  /// something that is farther away than all of that, by more than it slopes.
  int countCracks(std::span<const float> pictureDepths) const {
    int cracks = 0;
    for (int y = 1; y + 1 < height; ++y)
      for (int x = 1; x + 1 < width; ++x) {
        double least = infinity, greatest = -infinity;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) {
            double z = depths[size_t(y + dy) * width + x + dx];
            least = std::min(least, z);
            greatest = std::max(greatest, z);
          }
        bool isInside = greatest < 1;
        double limit = greatest + (greatest - least) + 1e-6;
        cracks += isInside && !(pictureDepths[size_t(y) * width + x] <
                                std::min(limit, 1.0));
      }
    return cracks;
  }

  int countCovered() const {
    return int(std::count_if(depths.begin(), depths.end(),
                             [](double z) { return z < 1; }));
  }

private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  static glm::dvec3 pointOf(const scene::Patch &patch, double u, double v) {
    auto weights = [](double t) {
      double s = 1 - t;
      return glm::dvec4(s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t);
    };
    glm::dvec4 wu = weights(u), wv = weights(v);
    glm::dvec3 sum(0);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        sum += wu[i] * wv[j] * glm::dvec3(patch.points[4 * i + j]);
    return sum;
  }

  /// Draws what is before the near plane of a triangle that is wholly
  /// before the eye.
  void draw(glm::dvec4 a, glm::dvec4 b, glm::dvec4 c) {
    if (std::min({a.w, b.w, c.w}) <= 0)
      return;
    glm::dvec3 p = toScreen(a), q = toScreen(b), r = toScreen(c);
    double area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    if (area == 0)
      return;
    int x0 = int(std::max(0.0, std::ceil(std::min({p.x, q.x, r.x}) - 0.5)));
    int y0 = int(std::max(0.0, std::ceil(std::min({p.y, q.y, r.y}) - 0.5)));
    double x1 = std::min(width - 0.5, std::max({p.x, q.x, r.x}));
    double y1 = std::min(height - 0.5, std::max({p.y, q.y, r.y}));
    for (int y = y0; y + 0.5 <= y1; ++y)
      for (int x = x0; x + 0.5 <= x1; ++x) {
        double sx = x + 0.5, sy = y + 0.5;
        double wr =
            ((q.x - p.x) * (sy - p.y) - (q.y - p.y) * (sx - p.x)) / area;
        double wp =
            ((r.x - q.x) * (sy - q.y) - (r.y - q.y) * (sx - q.x)) / area;
        double wq = 1 - wp - wr;
        double z = wp * p.z + wq * q.z + wr * r.z;
        if (wp >= 0 && wq >= 0 && wr >= 0 && z >= -1) {
          double &depth = depths[size_t(y) * width + x];
          depth = std::min(depth, z);
        }
      }
  }
  glm::dvec3 toScreen(glm::dvec4 p) const {
    return {(p.x / p.w + 1) * 0.5 * width, (1 - p.y / p.w) * 0.5 * height,
            p.z / p.w};
  }

  glm::dmat4 toClip;
  int width, height;
  std::vector<double> depths;
};

} // namespace piko

#endif // PIKO_UNITTESTS_EXAMPLES_FINETESSELLATION_H
