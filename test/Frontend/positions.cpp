// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A position may be a vector or a braced list of numbers: floats are a
// position, integers are cells, and the reference agrees.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
// RUN: %cxx_after_header -fsyntax-only %s
#include <piko.h>

struct Item {
  float x, y;
  double u;
  int i;
  short s;
};

// CHECK-LABEL: piko.stage @floats
// CHECK: math.floor %{{.*}} : f32
// CHECK: math.floor %{{.*}} : f32
// CHECK: piko.bin_at
struct Floats : piko::Stage<8, 8, 64, Item> {
  void assignBin(const Item &i) { assignToBin(i, binFromPosition({i.x, i.y})); }
  void process(const Item &) {}
};
// CHECK-LABEL: piko.stage @integers
// CHECK-NOT: math.floor
// CHECK: piko.bin_at
struct Integers : piko::Stage<8, 8, 64, Item> {
  void assignBin(const Item &i) {
    assignToBin(i, binFromPosition({i.i, 3}));
    assignToBin(i, binFromPosition({i.s, i.s}));
  }
  void process(const Item &) {}
};
// CHECK-LABEL: piko.stage @mixed
// CHECK: math.floor
// CHECK: piko.bin_at
struct Mixed : piko::Stage<8, 8, 64, Item> {
  void assignBin(const Item &i) {
    assignToBin(i, binFromPosition({i.x, 0}));
    assignToBin(i, binFromPosition({i.u, i.u}));
  }
  void process(const Item &) {}
};
// CHECK-LABEL: piko.stage @boxes
// CHECK: piko.assign_box
// CHECK: piko.assign_box
// CHECK: piko.assign_box
// CHECK: piko.assign_box
struct Boxes : piko::Stage<8, 8, 64, Item> {
  void assignBin(const Item &i) {
    assignToBoundingBox(i, {i.x, i.y}, {i.x + 1, i.y + 1});
    assignToBoundingBox(i, {i.i, 0}, {i.i, 7});
    assignToBoundingBox(i, {0, 0}, {i.x, i.y});
    assignToBoundingBox(i, {0, 0}, glm::vec2(i.x, i.y));
  }
  void process(const Item &) {}
};
// CHECK-LABEL: piko.stage @lines
// CHECK: math.floor
// CHECK: piko.assign_line
// CHECK: piko.assign_line
// CHECK: piko.assign_line
struct Lines : piko::Stage<8, 8, 64, Item> {
  void assignBin(const Item &i) {
    assignToLine(i, {i.x, i.y}, {i.x + 1, i.y + 1});
    assignToLine(i, {i.i, 0}, {i.i, 7});
    assignToLine(i, {0, 0}, glm::vec2(i.x, i.y));
  }
  void process(const Item &) {}
};
struct Pipeline : piko::Pipe<> {
  Floats floats;
  Integers integers;
  Mixed mixed;
  Boxes boxes;
  Lines lines;
  Pipeline() {
    source(floats);
    source(integers);
    source(mixed);
    source(boxes);
    source(lines);
  }
};
