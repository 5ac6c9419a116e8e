// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A stage that is called as a constant is called by its member, too; and a
// graph shows which stages wait for the end of others, at each level.
// RUN: pikoc %s --explain | FileCheck %s
// RUN: pikoc %s --emit=authored | piko-translate --piko-to-dot | FileCheck %s --check-prefix=DOT
// RUN: pikoc %s --emit=kernels | piko-translate --piko-to-dot | FileCheck %s --check-prefix=DOT
#include <piko.h>

struct State {
  float bloom = 2;
  piko::Image<float> light, image;
};
struct Mark : piko::Stage<8, 8, 64, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void process(const int &) {
    parallelForPixels([&](glm::ivec2 p) {
      update(state().light, p, [](float &light) { light += 1; });
    });
  }
};
struct Bloom : piko::Stage<8, 8, 64, int>, piko::Uses<State> {
  void assignBin(const int &i) { assignToAll(i); }
  void schedule(piko::BinId) {
    everyBin();
    endStage<Mark>();
  }
  void process(const piko::List<int> &) {
    parallelForPixels([&](glm::ivec2 p) {
      state().image.store(p, state().bloom * state().light(domain() - 1 - p));
    });
  }
};
struct Pipe : piko::Pipe<State> {
  Mark mark;
  Bloom bloom;
  Pipe() {
    source(mark);
    source(bloom);
  }
};

// CHECK: Stages, in order:
// CHECK: {{^  }}mark: bins of 8 x 8
// CHECK: {{^  }}bloom_stage ('bloom'): bins of 8 x 8

// DOT: "process mark" -> "process bloom_stage" [label="endStage", style=dashed, color=red];
