// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Vertices moved by four bones each, emitted and stored.
#include <piko.h>

struct Vertex {
  glm::vec3 position, normal;
  int bones[4];
  float weights[4];
  int index;
};
struct Placed {
  glm::vec3 position, normal;
  int index;
};
struct State {
  piko::Buffer<glm::mat4> bones;
  piko::Buffer<Placed> out;
};

struct Skin : piko::Stage<0, 0, 1, Vertex, Placed>, piko::Uses<State> {
  void process(const Vertex &v) {
    glm::mat4 m(0);
    for (int i = 0; i < 4; ++i)
      m += state().bones[v.bones[i]] * v.weights[i];
    glm::vec3 n = glm::mat3(m) * v.normal;
    emit({glm::vec3(m * glm::vec4(v.position, 1)), glm::normalize(n), v.index});
  }
};
struct Keep : piko::Stage<0, 0, 1, Placed>, piko::Uses<State> {
  void process(const Placed &p) { state().out[p.index] = p; }
};
struct Skinning : piko::Pipe<State> {
  Skin skin;
  Keep keep;
  Skinning() {
    source(skin);
    connect(skin, 0, keep);
  }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Vertex> vertices;
  std::vector<glm::mat4> bones;
  std::vector<Placed> out;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 64; ++i) {
      glm::mat4 m(1);
      for (int j = 0; j < 16; ++j)
        m[j / 4][j % 4] += random.in(-.2f, .2f);
      bones.push_back(m);
    }
    for (int i = 0; i < 20000; ++i) {
      Vertex v;
      v.position = {random.unit(), random.unit(), random.unit()};
      v.normal = {0, 0, 1};
      for (int j = 0; j < 4; ++j) {
        v.bones[j] = int(random.below(64));
        v.weights[j] = 0.25f;
      }
      v.index = i;
      vertices.push_back(v);
    }
    out.resize(vertices.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().bones, bones);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.skin, vertices);
  }
  // Of a vertex: 4 matrices of 16 that are scaled and summed, 9 products and 6
  // sums for the normal, 16 and 12 for the position; its length is a dot
  // product of 5, a root, a quotient, and 3 products.
  double flops() const { return 181.0 * double(vertices.size()); }
  // Vertices are read. What is placed is written, and again to the output.
  double bytes() const {
    return double(vertices.size() * (sizeof(Vertex) + 2 * sizeof(Placed)));
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(Skinning, Host)
#endif
