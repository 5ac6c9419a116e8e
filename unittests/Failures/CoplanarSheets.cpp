//===- CoplanarSheets.cpp - Two surfaces in the same place ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Depths of two triangles in the same plane are rounded differently if their
// corners are others, so that now the one is in front and now the other
// (z-fighting).
#include "Cast.h"
#include "Failure.h"

#include "../Support/Camera.h"

#include "ExampleOit.h"
#include "TolerantOit.h"

#include "Piko/Scene/SceneFile.h"

namespace failures {
namespace {

constexpr int size = 128;

/// A square that is seen at an angle, of so many cells a side.
void addSheet(piko::render::Mesh &mesh, int cells, glm::vec3 normal) {
  auto first = int(mesh.vertices.size());
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j) {
      float x = 4.0f * i / cells - 2, y = 4.0f * j / cells - 2;
      mesh.vertices.push_back({{x, y, -3 + 0.37f * x + 0.21f * y},
                               normal,
                               int32_t(mesh.vertices.size())});
    }
  auto add = [&](int a, int b, int c) {
    mesh.triangles.push_back({{a, b, c}, int32_t(mesh.triangles.size())});
  };
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      int a = first + i * (cells + 1) + j, b = a + cells + 1;
      add(a, b, a + 1);
      add(a + 1, b, b + 1);
    }
}

/// Two sheets, the first of which is in front.
piko::render::Mesh makeSheets(int cells) {
  piko::render::Mesh mesh;
  addSheet(mesh, 1, {0, 0, 1});
  addSheet(mesh, cells, {0, 0.9f, 0.436f});
  return mesh;
}

template <class Pipe> Image drawSheets(int cells) {
  piko::render::Mesh mesh = makeSheets(cells);
  auto vertices = castAll<typename Pipe::Vertex>(mesh.vertices);
  auto triangles = castAll<typename Pipe::Triangle>(mesh.triangles);
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.state().camera =
      std::bit_cast<typename Pipe::Camera>(test::makeCamera(0.25f, 1000));
  pipe.state().material = {0.5f};
  pipe.state().lights.assign(
      std::vector<typename Pipe::Light>{{{0, 0, 1, 0}, {1, 1, 1, 0}}});
  pipe.feed(pipe.vertexShader, vertices);
  pipe.feed(pipe.rasterizer, triangles);
  if constexpr (requires { pipe.resolve; }) {
    const typename Pipe::Nothing *nothing = nullptr;
    pipe.feed(2, nothing, 0);
  }
  pipe.run().orThrow();
  auto color = pipe.state().color.view();
  return paint(size, size, [&](int x, int y) {
    return std::bit_cast<piko::scene::Color>(color(x, y));
  });
}

/// Pixels that are not as they are if both sheets have the same corners, but
/// those at the border, which only one of them covers.
template <class Pipe> double countWrong(int cells) {
  Image image = drawSheets<Pipe>(cells), exact = drawSheets<Pipe>(1);
  int wrong = 0;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    glm::vec4 off = glm::abs(image.pixels[i].rgba - exact.pixels[i].rgba);
    wrong += off.x > 0.01f && off.a < 0.01f;
  }
  return wrong;
}

struct CoplanarSheets : Mode {
  Description describe() const override {
    return {"CoplanarSheets",
            "Two translucent sheets in the same plane",
            "cells a side of the second one",
            "pixels with the second one in front",
            "sorts depths as they are",
            "keeps the order of drawing within a tolerance",
            {1, 2, 3, 4, 6, 8, 16}};
  }
  Errors measure(double cells) const override {
    return {countWrong<pipelines::ExampleOit>(int(cells)),
            countWrong<pipelines::TolerantOit>(int(cells))};
  }
  Pictures draw() const override {
    return {drawSheets<pipelines::ExampleOit>(3),
            drawSheets<pipelines::TolerantOit>(3)};
  }
};
const Registration<CoplanarSheets> registration;

TEST(Failure, CoplanarSheets) {
  for (int cells : {3, 8}) {
    Errors errors = CoplanarSheets().measure(cells);
    EXPECT_GT(errors.naive, 1000) << cells;
    EXPECT_EQ(errors.ours, 0) << cells;
  }
}

} // namespace
} // namespace failures
