// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pixel of an update outside its bin has as many coordinates as there are
// dimensions, in the reference and compiled.
// REQUIRES: all
// RUN: %compare_targets %s --stops --pipe One --domain 16 --runs 1 --threads 1 2 --count 1 | FileCheck %s --check-prefix=ONE
// RUN: %compare_targets %s --stops --pipe Three --domain 8 8 8 --runs 1 --threads 1 2 --count 1 | FileCheck %s --check-prefix=THREE
// RUN: %compare_targets %s --stops --pipe Four --domain 8 8 8 8 --runs 1 --threads 1 2 --count 1 | FileCheck %s --check-prefix=FOUR
// ONE: expected: {{.*}} inside the stage's own bin, but got pixel (9); the bin has (0) to (3)
// ONE: got: {{.*}} inside the stage's own bin, but got pixel (9); the bin has (0) to (3)
// THREE: expected: {{.*}} inside the stage's own bin, but got pixel (1, -2, 6); the bin has (0, 0, 0) to (3, 3, 3)
// THREE: got: {{.*}} inside the stage's own bin, but got pixel (1, -2, 6); the bin has (0, 0, 0) to (3, 3, 3)
// FOUR: expected: {{.*}} inside the stage's own bin, but got pixel (1, 2, 3, 7); the bin has (0, 0, 0, 0) to (3, 3, 3, 3)
// FOUR: got: {{.*}} inside the stage's own bin, but got pixel (1, 2, 3, 7); the bin has (0, 0, 0, 0) to (3, 3, 3, 3)
#include <piko.h>

struct Point {
  int x;
};

template <int Rank> struct State {
  piko::Image<int, Rank> image;
};

template <int Rank, class B>
struct Outside : piko::BasicStage<B, 8, Point>, piko::Uses<State<Rank>> {
  void assignBin(const Point &p) { this->assignToBin(p, {0}); }
  void process(const Point &) {
    glm::vec<Rank, int> pixel;
    if constexpr (Rank == 1)
      pixel = glm::ivec1(9);
    else if constexpr (Rank == 3)
      pixel = glm::ivec3(1, -2, 6);
    else
      pixel = glm::ivec4(1, 2, 3, 7);
    this->update(this->state().image, pixel, [](int &value) { ++value; });
  }
};

struct One : piko::Pipe<State<1>> {
  Outside<1, piko::Bins<4>> stage;
  One() { source(stage); }
};
struct Three : piko::Pipe<State<3>> {
  Outside<3, piko::Bins<4, 4, 4>> stage;
  Three() { source(stage); }
};
struct Four : piko::Pipe<State<4>> {
  Outside<4, piko::Bins<4, 4, 4, 4>> stage;
  Four() { source(stage); }
};
