// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Meshes with vertices that are nowhere. `TrustingMesh` rejects a pixel that is
// on the wrong side of an edge, which nothing that is not a number is;
// `ExampleOit` is the example, which drops what has no place on the screen.
#include "oit/oit.piko.cpp"

namespace trusting {

using namespace piko::scene;

struct ScreenCorner {
  glm::vec3 at; // pixels, and depth
  glm::vec3 normal;
};
struct State {
  Camera camera;
  piko::Buffer<ScreenCorner> vertices; // one for each Vertex
  piko::Image<Color> color;
};

struct VertexShader : piko::Stage<0, 0, 64, Vertex>, piko::Uses<State> {
  void process(const Vertex &v) {
    glm::vec4 clip = state().camera.viewProjection * glm::vec4(v.position, 1);
    glm::vec3 ndc = glm::vec3(clip) / clip.w;
    glm::vec2 size = domain();
    state().vertices[v.index] = {
        {(ndc.x + 1) / 2 * size.x, (1 - ndc.y) / 2 * size.y, ndc.z}, v.normal};
  }
};

struct Draw : piko::Stage<16, 16, 64, Triangle>, piko::Uses<State> {
  struct Box {
    glm::ivec2 lo, hi;
  };
  Box boxOf(const Triangle &t) {
    glm::vec2 a = corner(t, 0).at, b = corner(t, 1).at, c = corner(t, 2).at;
    glm::vec2 lo = glm::min(glm::min(a, b), c),
              hi = glm::max(glm::max(a, b), c);
    return {{piko::toInt(lo.x), piko::toInt(lo.y)},
            {piko::toInt(hi.x), piko::toInt(hi.y)}};
  }
  void assignBin(const Triangle &t) {
    Box box = boxOf(t);
    assignToBoundingBox(t, box.lo, box.hi);
  }
  void schedule(piko::BinId) { endStage<VertexShader>(); }
  void process(const Triangle &t) {
    ScreenCorner a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    float area = edge(a.at, b.at, c.at);
    Box box = boxOf(t);
    parallelForPixels(box.lo, box.hi, [&](glm::ivec2 pixel) {
      glm::vec2 p = glm::vec2(pixel) + 0.5f;
      float u = edge(b.at, c.at, p) / area;
      float v = edge(c.at, a.at, p) / area;
      float w = edge(a.at, b.at, p) / area;
      if (u < 0 || v < 0 || w < 0)
        return;
      glm::vec3 normal = u * a.normal + v * b.normal + w * c.normal;
      glm::vec4 rgba(glm::vec3(0.1f + 0.2f * normal.z), 0.25f);
      update(state().color, pixel, [&](Color &behind) {
        behind.rgba = rgba + (1 - rgba.a) * behind.rgba;
      });
    });
  }

private:
  const ScreenCorner &corner(const Triangle &t, int i) {
    return state().vertices[t.vertex[i]];
  }
  static float edge(glm::vec2 a, glm::vec2 b, glm::vec2 p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  }
};

} // namespace trusting

struct TrustingMesh : piko::Pipe<trusting::State> {
  trusting::VertexShader vertexShader;
  trusting::Draw rasterizer;
  TrustingMesh() {
    source(vertexShader);
    source(rasterizer);
    allocateForSource(state().vertices, 0);
  }
};
struct ExampleOit : oit::Oit<{.bin = 16, .apart = false}> {};
