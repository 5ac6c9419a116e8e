//===- VerticesOnGrids.cpp - Edges that run through pixel centres ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "ClosedTriangles.h"
#include "FillRuleTriangles.h"
#include "OpenTriangles.h"

#include <algorithm>
#include <random>

namespace failures {
namespace {

constexpr int size = 128;
/// The mesh reaches from the centre of this pixel to that of the last one.
constexpr int first = 8, last = 120;

/// Where the vertices of a mesh of cells x cells quadrilaterals are.
enum class Grid { Centres, Sixteenths };

std::vector<glm::vec2> placeVertices(int cells, Grid grid) {
  std::minstd_rand random(1);
  const int whole = 16 * (last - first) / cells; // a cell, in 1/16 pixel
  std::uniform_int_distribution<int> offset(-whole / 4, whole / 4);
  std::vector<glm::vec2> vertices;
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      glm::ivec2 at = 16 * first + 8 + whole * glm::ivec2(i, j);
      bool isBorder = i == 0 || j == 0 || i == cells || j == cells;
      if (grid == Grid::Sixteenths && !isBorder)
        at += glm::ivec2{offset(random), offset(random)};
      vertices.push_back(glm::vec2(at) / 16.0f);
    }
  return vertices;
}

/// How often a mesh draws each pixel.
template <class Pipe> std::vector<int> drawMesh(int cells, Grid grid) {
  std::vector<glm::vec2> v = placeVertices(cells, grid);
  std::vector<typename Pipe::FlatTriangle> triangles;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      int at = j * (cells + 1) + i, below = at + cells + 1;
      triangles.push_back({v[at], v[at + 1], v[below + 1]});
      triangles.push_back({v[at], v[below + 1], v[below]});
    }
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.feed(pipe.draw, triangles);
  pipe.run().orThrow();
  auto image = pipe.state().image.view();
  std::vector<int> draws;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      draws.push_back(image(x, y).draws);
  return draws;
}

bool isInside(int x, int y) {
  return std::min(x, y) > first && std::max(x, y) < last;
}

int countWrong(const std::vector<int> &draws) {
  int wrong = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      wrong += isInside(x, y) && draws[y * size + x] != 1;
  return wrong;
}

Image show(const std::vector<int> &draws) {
  return paint(size, size, [&](int x, int y) {
    int n = draws[y * size + x];
    return n == 0 || !isInside(x, y) ? rgb(0, 0, 0)
           : n == 1                  ? rgb(0.8f, 0.8f, 0.8f)
                                     : rgb(1, 0.2f, 0.1f);
  });
}

template <class Naive, Grid G> struct OnGrid : Mode {
  Errors measure(double cells) const override {
    return {double(countWrong(drawMesh<Naive>(int(cells), G))),
            double(countWrong(
                drawMesh<pipelines::FillRuleTriangles>(int(cells), G)))};
  }
  Pictures draw() const override {
    return {show(drawMesh<Naive>(14, G)),
            show(drawMesh<pipelines::FillRuleTriangles>(14, G))};
  }
};

struct VerticesOnCentres : OnGrid<pipelines::ClosedTriangles, Grid::Centres> {
  Description describe() const override {
    return {"VerticesOnCentres",
            "Vertices on pixel centres",
            "quadrilaterals along a mesh",
            "pixels not drawn exactly once",
            "edges belong to both triangles",
            "a fill rule",
            {1, 4, 7, 14, 28, 56, 112}};
  }
};
const Registration<VerticesOnCentres> centres;

struct VerticesOnSixteenths
    : OnGrid<pipelines::OpenTriangles, Grid::Sixteenths> {
  Description describe() const override {
    return {"VerticesOnSixteenths",        "Vertices on a grid of 1/16 pixel",
            "quadrilaterals along a mesh", "pixels not drawn exactly once",
            "edges belong to no triangle", "a fill rule",
            {1, 4, 7, 14, 28, 56, 112}};
  }
};
const Registration<VerticesOnSixteenths> sixteenths;

TEST(Failure, VerticesOnCentres) {
  for (int cells : {1, 14, 112}) {
    Errors errors = VerticesOnCentres().measure(cells);
    EXPECT_GE(errors.naive, 111) << cells; // the diagonal at least
    EXPECT_EQ(errors.ours, 0) << cells;
  }
}

TEST(Failure, VerticesOnSixteenths) {
  for (int cells : {14, 112}) {
    Errors errors = VerticesOnSixteenths().measure(cells);
    EXPECT_GT(errors.naive, 10) << cells;
    EXPECT_EQ(errors.ours, 0) << cells;
  }
}

} // namespace
} // namespace failures
