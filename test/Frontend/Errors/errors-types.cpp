// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A value that the language's calls do not take is reported where it is given,
// with what they take.
// RUN: not piko-translate --cpp-to-piko -DCASE=1 %s 2>&1 | FileCheck %s --check-prefix=EMIT --implicit-check-not=note
// RUN: not piko-translate --cpp-to-piko -DCASE=2 %s 2>&1 | FileCheck %s --check-prefix=LOOP
// RUN: not piko-translate --cpp-to-piko -DCASE=3 %s 2>&1 | FileCheck %s --check-prefix=DRAIN --implicit-check-not=note
// RUN: not piko-translate --cpp-to-piko -DCASE=4 %s 2>&1 | FileCheck %s --check-prefix=POSITION --implicit-check-not=note
// RUN: not piko-translate --cpp-to-piko -DCASE=5 %s 2>&1 | FileCheck %s --check-prefix=CELLS
// RUN: not piko-translate --cpp-to-piko -DCASE=6 %s 2>&1 | FileCheck %s --check-prefix=BOX
// RUN: not piko-translate --cpp-to-piko -DCASE=7 %s 2>&1 | FileCheck %s --check-prefix=LINE
// RUN: piko-translate --cpp-to-piko -DCASE=0 %s | FileCheck %s --check-prefix=WELL
#include <piko.h>

namespace scene {
struct Particle {
  glm::vec4 at;
};
struct Fragment {
  glm::vec4 at;
};
} // namespace scene
struct Wrong {};

// WELL: piko.stage @stage
struct Stage : piko::BasicStage<piko::Bins<8, 8, 8>, 64, scene::Particle,
                                scene::Particle, scene::Fragment> {
  void assignBin(const scene::Particle &p) {
#if CASE == 4
    // POSITION: errors-types.cpp:[[#@LINE + 1]]:20: error: expected 3 dimensions, as the bins of the stage have, but got 4
    assignToBin(p, binFromPosition(p.at));
#elif CASE == 5
    // CELLS: errors-types.cpp:[[#@LINE + 1]]:20: error: expected 3 dimensions, as the bins of the stage have, but got 2
    assignToBin(p, binFromPosition(glm::ivec2(p.at)));
#elif CASE == 6
    // BOX: errors-types.cpp:[[#@LINE + 1]]:5: error: expected 3 dimensions, as the bins of the stage have, but got 4
    assignToBoundingBox(p, glm::ivec4(p.at), glm::ivec4(p.at) + 1);
#elif CASE == 7
    // LINE: errors-types.cpp:[[#@LINE + 1]]:5: error: expected 3 dimensions, as the bins of the stage have, but got 2
    assignToLine(p, glm::vec2(p.at), glm::vec2(p.at) + 1.0f);
#else
    assignToBin(p, binFromPosition(glm::vec3(p.at)));
#endif
  }
  void process(const scene::Particle &p) {
#if CASE == 1
    // EMIT: errors-types.cpp:[[#@LINE + 1]]:5: error: expected to emit 'scene::Particle' or 'scene::Fragment', as the ports of the stage have, but got 'Wrong'
    emit(Wrong{}, 1);
#elif CASE == 2
    // LOOP: errors-types.cpp:[[#@LINE + 1]]:33: error: expected to emit 'scene::Particle' or 'scene::Fragment', as the ports of the stage have, but got 'int'
    parallelFor(4, [&](int i) { emit(i); });
#else
    emit(p);
    emit(scene::Fragment{p.at}, 1);
#endif
  }
};
struct Drain : piko::BasicStage<piko::Bins<0, 0, 0>, 64, scene::Particle> {
  void process(const scene::Particle &p) {
#if CASE == 3
    // DRAIN: errors-types.cpp:[[#@LINE + 1]]:5: error: expected a stage with a port, but this one has none
    emit(p);
#endif
  }
};
struct DrainFragments
    : piko::BasicStage<piko::Bins<0, 0, 0>, 64, scene::Fragment> {
  void process(const scene::Fragment &) {}
};
struct Pipeline : piko::Pipe<> {
  Stage stage;
  Drain drain;
  DrainFragments fragments;
  Pipeline() {
    source(stage);
    connect(stage, 0, drain);
    connect(stage, 1, fragments);
  }
};
