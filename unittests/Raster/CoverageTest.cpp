//===- CoverageTest.cpp - Coverage against brute force --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles pass through clip space as in the pipeline, and each covered pixel
// is compared with a check in 128-bit integers of the corners as meant.
//
//===----------------------------------------------------------------------===//
#include "common/clip.h"

#include "../Examples/PixelsIn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace raster;

namespace {

struct ImageSize {
  int width, height;
};

/// A corner in 1/256 pixel.
struct Corner {
  int64_t x, y;
};

/// The clip position whose projection is that corner.
glm::vec4 toClip(Corner c, ImageSize size, float w = 1) {
  double x = double(c.x) / subpixels, y = double(c.y) / subpixels;
  return glm::vec4(float(2 * x / size.width - 1),
                   float(1 - 2 * y / size.height), 0.0f, 1.0f) *
         w;
}

ScreenPolygon polygonOf(Corner a, Corner b, Corner c, ImageSize size) {
  return ScreenPolygon(toClip(a, size), toClip(b, size), toClip(c, size),
                       {size.width, size.height}, false);
}

__int128 orient(Corner a, Corner b, Corner p) {
  return __int128(b.x - a.x) * (p.y - a.y) - __int128(b.y - a.y) * (p.x - a.x);
}

/// Whether p lies inside of the edge a -> b of a triangle that runs clockwise
/// on the screen, or on it and it is a top or a left edge.
bool holds(Corner a, Corner b, Corner p) {
  __int128 side = orient(a, b, p);
  if (side != 0)
    return side > 0;
  bool goesUp = b.y < a.y, goesRight = b.y == a.y && b.x > a.x;
  return goesUp || goesRight;
}

bool isCovered(Corner a, Corner b, Corner c, int x, int y) {
  __int128 area = orient(a, b, c);
  if (area == 0)
    return false;
  if (area < 0)
    std::swap(b, c);
  Corner p{int64_t(x) * subpixels + subpixels / 2,
           int64_t(y) * subpixels + subpixels / 2};
  return holds(a, b, p) && holds(b, c, p) && holds(c, a, p);
}

/// Counts how often each pixel of a window of the image is drawn.
class Window {
public:
  Window(glm::ivec2 lo, glm::ivec2 hi)
      : lo(lo), hi(hi), counts(size_t(hi.x - lo.x) * (hi.y - lo.y)) {}

  void draw(const ScreenPolygon &polygon) {
    polygon.rasterize(PixelsIn{lo, hi}, [&](const Sample &s) {
      ASSERT_TRUE(s.pixel.x >= lo.x && s.pixel.x < hi.x);
      ASSERT_TRUE(s.pixel.y >= lo.y && s.pixel.y < hi.y);
      ++at(s.pixel.x, s.pixel.y);
    });
  }
  int &at(int x, int y) {
    return counts[size_t(y - lo.y) * (hi.x - lo.x) + (x - lo.x)];
  }
  void clear() { std::fill(counts.begin(), counts.end(), 0); }

  /// How many pixels were drawn another number of times than this.
  int countOther(int times) const {
    return int(std::count_if(counts.begin(), counts.end(),
                             [&](int n) { return n != times; }));
  }

  const glm::ivec2 lo, hi;

private:
  std::vector<int> counts;
};

/// Where the corners of a random mesh may lie.
struct Lattice {
  const char *name;
  int64_t step, offset; ///< in 1/256 pixel
};

class Coverage : public testing::TestWithParam<std::tuple<ImageSize, Lattice>> {
protected:
  ImageSize size = std::get<0>(GetParam());
  Lattice lattice = std::get<1>(GetParam());
  std::mt19937_64 random{20240229};

  int64_t between(int64_t lo, int64_t hi) {
    return std::uniform_int_distribution<int64_t>(lo, hi)(random);
  }
  Corner nearestOnLattice(double x, double y) {
    auto snap = [&](double v) {
      return int64_t(std::floor((v * subpixels - lattice.offset) /
                                double(lattice.step))) *
                 lattice.step +
             lattice.offset;
    };
    return {snap(x), snap(y)};
  }
  Corner randomCorner(double x, double y, double reach) {
    std::uniform_real_distribution<double> d(-reach, reach);
    return nearestOnLattice(x + d(random), y + d(random));
  }
};

const ImageSize sizes[] = {
    {1024, 768}, {3840, 2160}, {15360, 8640}, {65536, 65536}};
const Lattice lattices[] = {{"PixelCentres", 256, 128}, {"Sixteenths", 16, 0}};

std::string nameOf(const testing::TestParamInfo<Coverage::ParamType> &info) {
  const auto &[size, lattice] = info.param;
  return std::to_string(size.width) + "x" + std::to_string(size.height) +
         lattice.name;
}

INSTANTIATE_TEST_SUITE_P(Sizes, Coverage,
                         testing::Combine(testing::ValuesIn(sizes),
                                          testing::ValuesIn(lattices)),
                         nameOf);

// Triangles of all extents, also across the image's border, pixel by pixel.
TEST_P(Coverage, EqualsBruteForce) {
  for (int i = 0; i < 4000; ++i) {
    double reach = std::exp2(double(between(0, 6)) + 0.5);
    double x = double(between(-8, size.width + 8));
    double y = double(between(-8, size.height + 8));
    Corner a = randomCorner(x, y, reach), b = randomCorner(x, y, reach),
           c = randomCorner(x, y, reach);
    auto [x0, x1] = std::minmax({a.x, b.x, c.x});
    auto [y0, y1] = std::minmax({a.y, b.y, c.y});
    glm::ivec2 lo = {std::clamp<int64_t>(x0 / subpixels - 2, 0, size.width),
                     std::clamp<int64_t>(y0 / subpixels - 2, 0, size.height)};
    glm::ivec2 hi = {std::clamp<int64_t>(x1 / subpixels + 3, 0, size.width),
                     std::clamp<int64_t>(y1 / subpixels + 3, 0, size.height)};
    Window window(lo, hi);
    window.draw(polygonOf(a, b, c, size));
    for (int py = lo.y; py < hi.y; ++py)
      for (int px = lo.x; px < hi.x; ++px)
        ASSERT_EQ(window.at(px, py), isCovered(a, b, c, px, py))
            << "triangle " << i << ", pixel " << px << ", " << py;
  }
}

// Triangles as large as the image, compared in windows along their edges.
TEST_P(Coverage, LargeTrianglesEqualBruteForce) {
  for (int i = 0; i < 150; ++i) {
    double reach = 0.6 * size.width;
    double cx = 0.5 * size.width, cy = 0.5 * size.height;
    Corner corner[3];
    for (Corner &c : corner)
      c = randomCorner(cx, cy, reach);
    ScreenPolygon polygon = polygonOf(corner[0], corner[1], corner[2], size);
    for (int k = 0; k < 12; ++k) {
      const Corner &a = corner[k % 3], &b = corner[(k + 1) % 3];
      double t = std::uniform_real_distribution<double>(0, 1)(random);
      int px = int((double(a.x) + t * double(b.x - a.x)) / subpixels);
      int py = int((double(a.y) + t * double(b.y - a.y)) / subpixels);
      glm::ivec2 lo = {std::clamp(px - 12, 0, size.width - 1),
                       std::clamp(py - 12, 0, size.height - 1)};
      Window window(lo, {std::min(lo.x + 24, size.width),
                         std::min(lo.y + 24, size.height)});
      window.draw(polygon);
      for (int y = window.lo.y; y < window.hi.y; ++y)
        for (int x = window.lo.x; x < window.hi.x; ++x)
          ASSERT_EQ(window.at(x, y),
                    isCovered(corner[0], corner[1], corner[2], x, y))
              << "triangle " << i << ", pixel " << x << ", " << y;
    }
  }
}

// A fan about a point on the lattice covers each pixel inside once. Its rim is
// a convex polygon around a window, so every pixel of the window is inside.
TEST_P(Coverage, ClosedFanDrawsEachPixelOnce) {
  for (int i = 0; i < 100; ++i) {
    int side = 40;
    glm::ivec2 lo = {between(0, size.width - side),
                     between(0, size.height - side)};
    double mx = lo.x + side / 2.0, my = lo.y + side / 2.0;
    Corner middle = randomCorner(mx, my, side * 0.4);
    int spokes = int(between(4, 24));
    std::vector<double> angles(spokes);
    for (int k = 0; k < spokes; ++k) // no gap of half a turn
      angles[k] =
          (k + 0.8 * std::uniform_real_distribution<double>(0, 1)(random)) * 2 *
          M_PI / spokes;
    std::vector<Corner> rim;
    double reach = side * 4;
    for (double angle : angles)
      rim.push_back(nearestOnLattice(mx + reach * std::cos(angle),
                                     my + reach * std::sin(angle)));
    Window window(lo, lo + side);
    for (int k = 0; k < spokes; ++k)
      window.draw(polygonOf(middle, rim[k], rim[(k + 1) % spokes], size));
    int wrong = 0;
    for (int y = lo.y; y < lo.y + side; ++y)
      for (int x = lo.x; x < lo.x + side; ++x) {
        int times = 0;
        for (int k = 0; k < spokes; ++k)
          times += isCovered(middle, rim[k], rim[(k + 1) % spokes], x, y);
        wrong += window.at(x, y) != times || times != 1;
      }
    ASSERT_EQ(wrong, 0) << "fan " << i << " with " << spokes << " spokes";
  }
}

/// The corners of a grid of cells in eye space that slopes through the near
/// plane or leaves the guard band, in clip space.
std::vector<glm::vec4> makeSheet(int cells, std::mt19937_64 &random,
                                 glm::vec3 origin, glm::vec3 u, glm::vec3 v) {
  std::uniform_real_distribution<float> jitter(-0.3f, 0.3f);
  const float nearZ = 0.1f, farZ = 1000;
  std::vector<glm::vec4> corners;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      bool isRim = i == 0 || j == 0 || i == cells || j == cells;
      float s = (i + (isRim ? 0 : jitter(random))) / cells;
      float t = (j + (isRim ? 0 : jitter(random))) / cells;
      glm::vec3 p = origin + u * s + v * t; // looking along z
      float a = (farZ + nearZ) / (farZ - nearZ);
      float b = 2 * farZ * nearZ / (farZ - nearZ);
      corners.emplace_back(p.x, p.y, a * p.z - b, p.z);
    }
  return corners;
}

void drawSheet(Window &window, const std::vector<glm::vec4> &corners, int cells,
               ImageSize size) {
  auto draw = [&](int a, int b, int c) {
    window.draw(ScreenPolygon(corners[a], corners[b], corners[c],
                              {size.width, size.height}, false));
  };
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      int a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
      draw(a, b, d);
      draw(a, d, c);
    }
}

// A floor from behind the camera to far ahead fills the lower half of the
// image without a hole, though many of its triangles are cut.
TEST(Clipping, FloorThroughTheNearPlaneHasNoHoles) {
  std::mt19937_64 random(7);
  ImageSize size{640, 480};
  for (int i = 0; i < 20; ++i) {
    std::uniform_real_distribution<float> d(-1, 1);
    float y = -0.4f + 0.3f * d(random), roll = d(random);
    int cells = 2 + int(random() % 12);
    // Below the horizon everything is floor; a pixel is seen once.
    auto corners = makeSheet(cells, random, {-500 + roll, y, -300 + d(random)},
                             {1000, 0, 0}, {0, 0, 1200});
    Window window({0, size.height / 2 + 2}, {size.width, size.height});
    drawSheet(window, corners, cells, size);
    EXPECT_EQ(window.countOther(1), 0) << "floor " << i;
  }
}

// A wall that reaches far beyond the guard band, seen close.
TEST(Clipping, WallBeyondTheGuardBandHasNoHoles) {
  std::mt19937_64 random(8);
  for (ImageSize size : {ImageSize{320, 240}, ImageSize{1024, 768}}) {
    for (int i = 0; i < 20; ++i) {
      std::uniform_real_distribution<float> d(-1, 1);
      int cells = 1 + int(random() % 10);
      float reach = 2000 * (1.5f + d(random));
      auto corners =
          makeSheet(cells, random, {-reach + 50 * d(random), -reach, 1 + i},
                    {2 * reach, 0, 300 * (1 + d(random))}, {0, 2 * reach, 0});
      Window window({0, 0}, {size.width, size.height});
      drawSheet(window, corners, cells, size);
      EXPECT_EQ(window.countOther(1), 0) << "wall " << i;
    }
  }
}

// Cells of less than a pixel on a floor that the near plane cuts along a slope:
// each column is drawn once from the top of the window down to the cut, and not
// below.
TEST(Clipping, TinyCutPolygonsFitTogether) {
  std::mt19937_64 random(9);
  ImageSize size{256, 256};
  for (int i = 0; i < 20; ++i) {
    std::uniform_real_distribution<float> d(-1, 1);
    int cells = 100 + int(random() % 200);
    auto corners =
        makeSheet(cells, random, {-0.06f + 0.001f * d(random), -0.05f, 0.09f},
                  {0.12f, 0.01f * d(random), 0}, {0.01f * d(random), 0, 0.06f});
    Window window({90, 178}, {166, 210});
    drawSheet(window, corners, cells, size);
    int wrong = 0, drawn = 0;
    for (int x = window.lo.x; x < window.hi.x; ++x)
      for (int y = window.lo.y, above = 1; y < window.hi.y; ++y) {
        int times = window.at(x, y);
        wrong += times > above;
        above = times;
        drawn += times;
      }
    EXPECT_EQ(wrong, 0) << "sheet " << i;
    EXPECT_GT(drawn, 0) << "sheet " << i;
  }
}

TEST(Clipping, ABinDrawsItsPartOfThePolygon) {
  std::mt19937_64 random(10);
  std::uniform_real_distribution<float> d(-1, 1);
  ImageSize size{100, 60};
  for (int i = 0; i < 200; ++i) {
    glm::vec4 c[3];
    for (glm::vec4 &p : c)
      p = {4 * d(random), 4 * d(random), d(random), 0.5f + d(random)};
    ScreenPolygon polygon(c[0], c[1], c[2], {size.width, size.height}, false);
    Window whole({0, 0}, {size.width, size.height});
    whole.draw(polygon);
    PixelBox box = polygon.box();
    for (int y = 0; y < size.height; y += 8)
      for (int x = 0; x < size.width; x += 8) {
        Window bin({x, y},
                   {std::min(x + 8, size.width), std::min(y + 8, size.height)});
        bin.draw(polygon);
        for (int py = bin.lo.y; py < bin.hi.y; ++py)
          for (int px = bin.lo.x; px < bin.hi.x; ++px) {
            ASSERT_EQ(bin.at(px, py), whole.at(px, py));
            ASSERT_LE(bin.at(px, py), 1);
            bool isInBox = px >= box.lo.x && px <= box.hi.x && py >= box.lo.y &&
                           py <= box.hi.y;
            ASSERT_TRUE(bin.at(px, py) == 0 || isInBox);
          }
      }
  }
}

TEST(Clipping, BadTrianglesAreDropped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const float odd[] = {nan, inf, -inf, 0, 1e38f, -1e38f, 1e14f, 1e-44f, 1, -1};
  glm::ivec2 size(16384, 16384);
  std::mt19937_64 random(11);
  for (int i = 0; i < 20000; ++i) {
    glm::vec4 c[3];
    for (glm::vec4 &p : c)
      for (int k = 0; k < 4; ++k)
        p[k] = odd[random() % std::size(odd)];
    ScreenPolygon polygon(c[0], c[1], c[2], size, false);
    polygon.rasterize(PixelsIn{{8000, 8000}, {8008, 8008}},
                      [&](const Sample &s) {
                        ASSERT_TRUE(s.pixel.x >= 8000 && s.pixel.x < 8008);
                      });
  }
  ScreenPolygon withNaN({nan, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, size,
                        false);
  EXPECT_LT(withNaN.box().hi.x, withNaN.box().lo.x);
  ScreenPolygon line({0, 0, 0, 1}, {0.5, 0.5, 0, 1}, {1, 1, 0, 1}, size, false);
  EXPECT_LT(line.box().hi.x, line.box().lo.x);
}

TEST(Clipping, BackFacesAreCulledOnRequest) {
  glm::vec4 a(-1, -1, 0, 1), b(1, -1, 0, 1), c(0, 1, 0, 1);
  auto isDrawn = [&](glm::vec4 p, glm::vec4 q, glm::vec4 r, bool cull) {
    PixelBox box = ScreenPolygon(p, q, r, {64, 64}, cull).box();
    return box.lo.x <= box.hi.x;
  };
  EXPECT_TRUE(isDrawn(a, b, c, true)); // counterclockwise
  EXPECT_FALSE(isDrawn(a, c, b, true));
  EXPECT_TRUE(isDrawn(a, b, c, false));
  EXPECT_TRUE(isDrawn(a, c, b, false));
}

// 1/w weights: halfway between w = 1 and w = 3 on the screen, three quarters
// of the nearer corner remain.
TEST(Interpolation, IsPerspectiveCorrect) {
  glm::vec4 a = glm::vec4(-1, -1, 0, 1), b = glm::vec4(1, -1, 0, 1) * 3.0f,
            c = glm::vec4(-1, 1, 0, 1);
  ScreenPolygon polygon(a, b, c, {512, 512}, false);
  bool seen = false;
  polygon.rasterize(PixelsIn{{255, 511}, {256, 512}}, [&](const Sample &s) {
    seen = true;
    EXPECT_NEAR(s.weight.x, 0.75f, 0.01f);
    EXPECT_NEAR(s.weight.y, 0.25f, 0.01f);
    EXPECT_NEAR(s.weight.z, 0.0f, 0.01f);
  });
  EXPECT_TRUE(seen);
}

// What is cut at the near plane keeps its attributes.
TEST(Interpolation, ClippedPartsKeepTheirWeights) {
  // In eye space; the attribute is z itself.
  glm::vec3 corners[] = {{-3, -1, -2}, {3, -1, -2.5f}, {0.2f, 0.5f, 6}};
  const float nearZ = 0.5f, farZ = 50;
  float k = (farZ + nearZ) / (farZ - nearZ);
  float l = 2 * farZ * nearZ / (farZ - nearZ);
  glm::vec4 clip[3];
  for (int i = 0; i < 3; ++i)
    clip[i] = {corners[i].x, corners[i].y, k * corners[i].z - l, corners[i].z};
  ScreenPolygon polygon(clip[0], clip[1], clip[2], {64, 64}, false);
  int pixels = 0;
  polygon.rasterize(PixelsIn{{0, 0}, {64, 64}}, [&](const Sample &s) {
    ++pixels;
    glm::vec3 p = corners[0] * s.weight.x + corners[1] * s.weight.y +
                  corners[2] * s.weight.z;
    EXPECT_NEAR((p.x / p.z + 1) * 32, s.pixel.x + 0.5f, 0.02f);
    EXPECT_NEAR((1 - p.y / p.z) * 32, s.pixel.y + 0.5f, 0.02f);
    EXPECT_NEAR((k * p.z - l) / p.z, s.depth, 1e-3f);
  });
  EXPECT_GT(pixels, 50);
}

} // namespace
