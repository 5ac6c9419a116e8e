// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

using piko::scene::Color, piko::scene::Triangle, piko::scene::Vertex;

constexpr int tile = piko::tunable("tile", 8, 16, 32, 64, 0);
constexpr auto cores =
    piko::tunable("cores", piko::LoadBalance, piko::DirectMap, piko::Serialize);

struct Corner {
  glm::vec2 at; // in pixels
  float near, light;
};
struct Facet {
  Corner a, b, c;
};
struct Fragment {
  glm::ivec2 pixel;
  float near, light;
};

struct World {
  piko::scene::Camera camera;
  piko::Buffer<Vertex> vertices;
  float tint = 0;           // 1: show which bin a pixel is in
  piko::Image<Color> image; // its alpha says how near, 0 is infinitely far
};

struct Project : piko::Stage<0, 0, 64, Triangle, Facet>, piko::Uses<World> {
  Corner project(int index) {
    const Vertex &v = state().vertices[index];
    glm::vec4 at = state().camera.viewProjection * glm::vec4(v.position, 1);
    glm::vec2 unit = (glm::vec2(at.x, -at.y) / at.w + 1.0f) * 0.5f;
    glm::vec3 toEye = glm::normalize(state().camera.eye - v.position);
    float light = glm::abs(glm::dot(v.normal, toEye));
    return {unit * glm::vec2(domain()), 1 / at.w, light};
  }

  void process(const Triangle &t) {
    emit({project(t.vertex.x), project(t.vertex.y), project(t.vertex.z)});
  }
};

struct Fill : piko::Stage<tile, tile, 64, Facet, Fragment> {
  static float cross(glm::vec2 u, glm::vec2 v) { return u.x * v.y - u.y * v.x; }

  void assignBin(const Facet &f) {
    assignToBoundingBox(f, glm::min(f.a.at, glm::min(f.b.at, f.c.at)),
                        glm::max(f.a.at, glm::max(f.b.at, f.c.at)));
  }

  void schedule(piko::BinId) { specifySchedule(cores); }

  void process(const Facet &f) {
    glm::vec2 a = f.a.at, b = f.b.at, c = f.c.at;
    float area = cross(b - a, c - a);
    parallelForPixels([&](glm::ivec2 pixel) {
      glm::vec2 p = glm::vec2(pixel) + 0.5f;
      float u = cross(c - b, p - b) / area, v = cross(a - c, p - c) / area;
      float w = 1 - u - v;
      if (!(u >= 0 && v >= 0 && w >= 0))
        return; // outside, or no area
      float near = u * f.a.near + v * f.b.near + w * f.c.near;
      float light = u * f.a.light + v * f.b.light + w * f.c.light;
      emit({pixel, near, light});
    });
  }
};

struct Blend : piko::Stage<tile, tile, 64, Fragment>, piko::Uses<World> {
  void assignBin(const Fragment &f) { assignToPreviousBins(f); }

  void process(const Fragment &f) {
    float odd = float(bin().index * 7 % 5) / 4;
    glm::vec3 color = glm::mix(glm::vec3(1, 0.85, 0.65),
                               glm::vec3(odd, 0.6, 1 - odd), state().tint);
    update(state().image, f.pixel, [&](Color &known) {
      if (f.near > known.rgba.a)
        known.rgba = glm::vec4(f.light * color, f.near);
    });
  }
};

struct Rasterizer : piko::Pipe<World> {
  Project project;
  Fill fill;
  Blend blend;
  Rasterizer() {
    source(project);
    connect(project, 0, fill);
    connect(fill, 0, blend);
  }
};
