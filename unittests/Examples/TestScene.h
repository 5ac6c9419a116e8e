//===- TestScene.h - Scenes for tests of pipelines --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_EXAMPLES_TESTSCENE_H
#define PIKO_UNITTESTS_EXAMPLES_TESTSCENE_H

#include "../Support/Camera.h"

#include <piko.h>
#include <piko/scene.h>

#include <cstring>
#include <random>
#include <vector>

namespace test {

using namespace piko::scene;

struct Input {
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<Light> lights;
  Settings settings;

  int addVertex(glm::vec3 position, glm::vec3 normal) {
    vertices.push_back({position, normal, int32_t(vertices.size())});
    return vertices.back().index;
  }
  void addTriangle(int a, int b, int c) {
    triangles.push_back({{a, b, c}, int32_t(triangles.size())});
  }
};

/// A square of two triangles that faces the camera at a distance.
inline void addSquare(Input &input, glm::vec2 center, float half,
                      float distance, glm::vec3 normal = {0, 0, 1}) {
  int v[4];
  for (int i = 0; i < 4; ++i) {
    float x = i == 1 || i == 2 ? half : -half, y = i >= 2 ? half : -half;
    v[i] = input.addVertex({center.x + x, center.y + y, -distance}, normal);
  }
  input.addTriangle(v[0], v[1], v[2]);
  input.addTriangle(v[0], v[2], v[3]);
}

/// Triangles everywhere, also behind the camera and far outside of the view.
inline Input makeSoup(int count) {
  Input input;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> d(-1, 1);
  for (int i = 0; i < count; ++i) {
    glm::vec3 center(8 * d(random), 8 * d(random), 8 * d(random) - 4);
    float reach = i % 10 == 0 ? 6 : 0.7f;
    int corner[3];
    for (int &c : corner)
      c = input.addVertex(
          center + reach * glm::vec3(d(random), d(random), d(random)),
          {d(random), d(random), d(random)});
    input.addTriangle(corner[0], corner[1], corner[2]);
  }
  input.lights = {{{0, 0.6f, 0.8f, 0}, {0.7f, 0.6f, 0.5f, 0}},
                  {{1, 2, 3, 1}, {0.2f, 0.3f, 0.4f, 0}}};
  return input;
}

using Picture = std::vector<Color>;

/// A picture that a pipeline has drawn.
inline Picture copy(const piko::Image<Color> &image) {
  return {image.data(),
          image.data() + size_t(image.extent()[0]) * image.extent()[1]};
}

inline bool equal(const Picture &a, const Picture &b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(Color)) == 0;
}

/// Gives a mesh to a pipeline, as a buffer of vertices or through sources.
template <class Pipeline>
void feedMesh(Pipeline &pipeline, const Input &input) {
  constexpr bool hasMesh = requires { pipeline.state().mesh; };
  if constexpr (hasMesh)
    pipeline.state().mesh.assign(input.vertices);
  if constexpr (requires { pipeline.setup; }) {
    pipeline.feed(pipeline.vertexShader, input.vertices);
    pipeline.feed(pipeline.setup, input.triangles);
  } else if constexpr (hasMesh) {
    pipeline.feed(pipeline.vertexShader, input.triangles);
  } else {
    pipeline.feed(pipeline.vertexShader, input.vertices);
    pipeline.feed(pipeline.rasterizer, input.triangles);
  }
}

} // namespace test

#endif // PIKO_UNITTESTS_EXAMPLES_TESTSCENE_H
