//===- MeshNoise.cpp - Vertices that are nowhere --------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Cast.h"
#include "Failure.h"

#include "../Support/Camera.h"

#include "ExampleOit.h"
#include "TrustingMesh.h"

#include "Piko/Scene/SceneFile.h"

#include <cmath>
#include <limits>
#include <random>

namespace failures {
namespace {

constexpr int size = 128;

/// What can be wrong with a triangle.
enum Noise {
  notANumber,
  infinite,
  huge,
  twice,
  unreferenced,
  kinds,
  collinear
};

/// A translucent ball, and what a broken file may have besides.
struct NoisyBall {
  piko::render::Mesh mesh;

  NoisyBall() {
    constexpr int rings = 12, around = 24;
    for (int i = 0; i <= rings; ++i)
      for (int j = 0; j < around; ++j) {
        double polar = M_PI * i / rings, angle = 2 * M_PI * j / around;
        glm::vec3 n(std::sin(polar) * std::cos(angle), std::cos(polar),
                    std::sin(polar) * std::sin(angle));
        addVertex(glm::vec3(0, 0, -3) + 2.0f * n, n);
      }
    for (int i = 0; i < rings; ++i)
      for (int j = 0; j < around; ++j) {
        int a = i * around + j, b = i * around + (j + 1) % around;
        if (i > 0)
          addTriangle(a, b, b + around);
        if (i + 1 < rings)
          addTriangle(a, b + around, a + around);
      }
  }

  int addVertex(glm::vec3 position, glm::vec3 normal) {
    mesh.vertices.push_back({position, normal, int32_t(mesh.vertices.size())});
    return mesh.vertices.back().index;
  }
  void addTriangle(int a, int b, int c) {
    mesh.triangles.push_back({{a, b, c}, int32_t(mesh.triangles.size())});
  }

  /// Adds triangles of the ball's vertices and one that is wrong.
  void addNoise(Noise kind, int count) {
    std::mt19937 random(unsigned(kind) + 1);
    auto vertices = int(mesh.vertices.size());
    for (int i = 0; i < count; ++i) {
      int a = int(random() % vertices), b = int(random() % vertices);
      int wrong = addVertex(wrongPosition(kind, a, b, i), {0, 0, 1});
      if (kind != unreferenced)
        addTriangle(a, b, wrong);
    }
  }

private:
  glm::vec3 wrongPosition(Noise kind, int a, int b, int i) const {
    glm::vec3 p = mesh.vertices[a].position;
    switch (kind) {
    case notANumber:
    case unreferenced:
      p[i % 3] = std::numeric_limits<float>::quiet_NaN();
      return p;
    case infinite:
      p[i % 3] = (i % 2 == 0 ? 1 : -1) * std::numeric_limits<float>::infinity();
      return p;
    case huge:
      p[i % 3] = (i % 2 == 0 ? 1 : -1) * 1e30f;
      return p;
    case collinear:
      return (p + mesh.vertices[b].position) * 0.5f;
    default:
      return p;
    }
  }
};

template <class Pipe> Image drawBall(const NoisyBall &ball) {
  auto vertices = castAll<typename Pipe::Vertex>(ball.mesh.vertices);
  auto triangles = castAll<typename Pipe::Triangle>(ball.mesh.triangles);
  Pipe pipe;
  pipe.setDomain({size, size});
  pipe.state().camera =
      std::bit_cast<typename Pipe::Camera>(test::makeCamera(0.25f, 1000));
  if constexpr (requires { typename Pipe::Light; })
    pipe.state().lights.assign(
        std::vector<typename Pipe::Light>{{{0, 0.6f, 0.8f, 0}, {1, 1, 1, 0}}});
  pipe.feed(pipe.vertexShader, vertices);
  pipe.feed(pipe.rasterizer, triangles);
  pipe.run().orThrow();
  auto color = pipe.state().color.view();
  return paint(size, size, [&](int x, int y) {
    return std::bit_cast<piko::scene::Color>(color(x, y));
  });
}

/// Pixels that are not as without the noise.
template <class Pipe> double countChanged(const NoisyBall &noisy) {
  Image with = drawBall<Pipe>(noisy), without = drawBall<Pipe>(NoisyBall());
  int changed = 0;
  for (size_t i = 0; i < with.pixels.size(); ++i)
    changed += with.pixels[i].rgba != without.pixels[i].rgba;
  return changed;
}

Errors compare(const NoisyBall &ball) {
  return {countChanged<pipelines::TrustingMesh>(ball),
          countChanged<pipelines::ExampleOit>(ball)};
}

NoisyBall makeNoisyBall(int count) {
  NoisyBall ball;
  for (int kind = 0; kind < kinds; ++kind)
    ball.addNoise(Noise(kind), count);
  return ball;
}

/// What is not a number in red.
Image show(const Image &image) {
  return paint(size, size, [&](int x, int y) {
    auto color = image.pixels[y * size + x];
    return glm::any(glm::isnan(color.rgba)) ? rgb(1, 0.1f, 0.1f) : color;
  });
}

struct MeshNoise : Mode {
  Description describe() const override {
    return {"MeshNoise",
            "Vertices that are not numbers, infinite, huge or twice the same",
            "wrong vertices of each kind in a mesh of 528 triangles",
            "pixels that change",
            "draws all triangles",
            "drops what has no place or no area",
            {0, 1, 2, 4, 8, 16, 32}};
  }
  Errors measure(double count) const override {
    return compare(makeNoisyBall(int(count)));
  }
  Pictures draw() const override {
    NoisyBall ball = makeNoisyBall(4);
    return {show(drawBall<pipelines::TrustingMesh>(ball)),
            show(drawBall<pipelines::ExampleOit>(ball))};
  }
};
const Registration<MeshNoise> registration;

TEST(Failure, MeshNoise) {
  Errors errors = MeshNoise().measure(8);
  EXPECT_GT(errors.naive, 1000);
  EXPECT_EQ(errors.ours, 0);
}

Errors compareKind(Noise kind) {
  NoisyBall ball;
  ball.addNoise(kind, 32);
  return compare(ball);
}

TEST(Failure, MeshNoiseOfEachKind) {
  for (Noise kind : {notANumber, infinite, huge})
    EXPECT_GT(compareKind(kind).naive, 5000) << kind;
  for (int kind = 0; kind < kinds; ++kind)
    EXPECT_EQ(compareKind(Noise(kind)).ours, 0) << kind;
}

// Three points of a line are not quite on one when they are on the screen's
// grid, so that a pixel's centre may be between them.
TEST(Failure, MeshNoiseCollinear) { EXPECT_LE(compareKind(collinear).ours, 2); }

} // namespace
} // namespace failures
