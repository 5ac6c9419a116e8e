// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arrays and classes of images and buffers: each is a piece of state of its own,
// named as the text names it, and what chooses one is known when the pipeline is
// compiled, be it by a loop that is unrolled or a template's argument.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Layers --domain 19 13 --count 40
// CASE: --pipe Deferred --domain 19 13 --count 12
// CASE: --pipe Cascades --count 50
// CASE: --pipe Nested --domain 19 13 --count 9
// RUN: piko-compare %s --pipe Layers --domain 19 13 --count 40 --runs 1 --check
// RUN: pikoc %s --pipe Nested -o - --emit=authored | FileCheck %s
// CHECK-DAG: piko.image @"level[0].color"
// CHECK-DAG: piko.image @"level[1].parts[1]"
// CHECK-DAG: piko.buffer @"level[1].sums"
#include <piko.h>

struct LayerState {
  piko::Image<int> layers[3];
  int scale = 3;
};
struct Write : piko::Stage<8, 8, 64, int>, piko::Uses<LayerState> {
  void assignBin(const int &i) { assignToAll(i); }
  void process(const int &i) {
    parallelForPixels([&](glm::ivec2 at) {
      update(state().layers[1], at,
             [&](int &p) { p = p * 3 + i * state().scale + at.x; });
      if (at.y % 2 == 0)
        update(state().layers[2], at, [&](int &p) { p += at.y; });
    });
  }
};
struct Layers : piko::Pipe<LayerState> {
  Write write;
  Layers() { source(write); }
};

struct Surface {
  piko::Image<float> depth;
  piko::Image<glm::vec3> normal;
};
struct Scene {
  Surface surface;
  piko::Buffer<float> lights;
};
struct Fill : piko::Stage<8, 8, 64, int>, piko::Uses<Scene> {
  void assignBin(const int &i) { assignToAll(i); }
  void process(const int &i) {
    parallelForPixels([&](glm::ivec2 at) {
      Surface &to = state().surface;
      float depth = float((i * 7 + at.x) % 11);
      update(to.depth, at, [&](float &z) { z = z > depth ? z : depth; });
      update(to.normal, at, [&](glm::vec3 &n) {
        n += glm::vec3(depth, state().lights[i & 7], 1);
      });
    });
  }
};
struct Deferred : piko::Pipe<Scene> {
  Fill fill;
  Deferred() { source(fill); }
};

struct Filters {
  piko::Buffer<float> weights[4];
  piko::Buffer<float> out[2][2];
};
struct Sum : piko::Stage<0, 0, 64, int>, piko::Uses<Filters> {
  template <int K> float weight(int i) const { return state().weights[K][i]; }
  void process(const int &i) {
    float sum = weight<0>(i) + 2 * weight<1>(i) + 3 * weight<2>(i);
    state().out[0][1][i] = sum;
    state().out[1][0][i] = sum - weight<3>(i);
  }
};
struct Cascades : piko::Pipe<Filters> {
  Sum sum;
  Cascades() { source(sum); }
};

struct Level {
  piko::Image<float> color;
  piko::Image<int> parts[2];
  piko::Buffer<float> sums;
};
struct Pyramid {
  Level level[2];
};
struct Draw : piko::Stage<8, 8, 64, int>, piko::Uses<Pyramid> {
  void assignBin(const int &i) { assignToAll(i); }
  static void add(Draw &stage, Level &level, int part, int i) {
    stage.parallelForPixels([&](glm::ivec2 at) {
      stage.update(level.color, at,
                   [&](float &c) { c += level.sums[i & 15] + float(part); });
      stage.update(level.parts[1], at, [&](int &p) { p ^= i + part; });
    });
  }
  void process(const int &i) {
    add(*this, state().level[0], 1, i);
    add(*this, state().level[1], 2, i);
  }
};
struct Nested : piko::Pipe<Pyramid> {
  Draw draw;
  Nested() { source(draw); }
};
