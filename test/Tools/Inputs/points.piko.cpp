// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Another pipeline than the examples': each vertex colours its pixel. The state
// has other names, and no triangles come in.
#include <piko.h>
#include <piko/scene.h>

struct PointState {
  piko::scene::Camera eye;
  piko::Image<piko::scene::Color> picture;
};

struct Dot {
  glm::ivec2 pixel;
};

struct Project : piko::Stage<0, 0, 64, piko::scene::Vertex, Dot>,
                 piko::Uses<PointState> {
  void process(const piko::scene::Vertex &v) {
    glm::vec4 p = state().eye.viewProjection * glm::vec4(v.position, 1);
    glm::vec2 size(domain());
    float x = (p.x / p.w * 0.5f + 0.5f) * size.x;
    float y = (0.5f - p.y / p.w * 0.5f) * size.y;
    emit(Dot{{piko::toInt(x), piko::toInt(y)}}, 0);
  }
};

struct Draw : piko::Stage<0, 0, 64, Dot>, piko::Uses<PointState> {
  void process(const Dot &d) {
    update(state().picture, d.pixel,
           [&](piko::scene::Color &c) { c.rgba = glm::vec4(1); });
  }
};

struct Points : piko::Pipe<PointState> {
  Project project;
  Draw draw;
  Points() {
    source(project);
    connect(project, 0, draw);
  }
};
