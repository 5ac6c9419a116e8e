// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops over the components of a vector, in glm's functions and in the user's
// text, are unrolled, so that each component has its name; longer ones, and those
// that emit, stay.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <piko.h>

struct Ray {
  glm::vec3 origin, direction;
};

// CHECK-LABEL: piko.stage @mixed
// CHECK-NOT: scf.while
// CHECK-NOT: scf.index_switch
// CHECK: piko.emit
struct Mixed : piko::Stage<0, 0, 64, Ray, Ray> {
  void process(const Ray &r) {
    glm::vec3 near = glm::mix(r.origin, r.direction,
                              glm::greaterThan(r.direction, glm::vec3(0)));
    if (glm::any(glm::lessThan(near, glm::vec3(-1))))
      near = glm::abs(near);
    emit({near, glm::floor(near)});
  }
};

// The axes of a vector, and of a matrix.
// CHECK-LABEL: piko.stage @axes
// CHECK-NOT: scf.while
// CHECK-NOT: memref
// CHECK: piko.emit
struct Axes : piko::Stage<0, 0, 64, Ray, Ray> {
  void process(const Ray &r) {
    Ray out{};
    for (int axis = 0; axis < 3; ++axis)
      if (r.direction[axis] > 0)
        out.origin[(axis + 1) % 3] = r.origin[axis];
    glm::mat3 frame(0);
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row)
        frame[column][row] = r.origin[column] * r.direction[row];
    out.direction = frame[2];
    emit(out);
  }
};

// CHECK-LABEL: piko.stage @stays
// CHECK: scf.while
// CHECK: scf.while
// CHECK: piko.emit
struct Stays : piko::Stage<0, 0, 64, Ray, Ray> {
  void process(const Ray &r) {
    float sum = 0;
    for (int i = 0; i < 5; ++i)
      sum = sum * r.origin.x + r.origin.y;
    for (int i = 0; i < 2; ++i)
      emit({glm::vec3(sum), r.direction});
  }
};

struct Last : piko::Stage<0, 0, 64, Ray> {
  void process(const Ray &) {}
};
struct Pipeline : piko::Pipe<> {
  Mixed mixed;
  Axes axes;
  Stays stays;
  Last last;
  Pipeline() {
    source(mixed);
    connect(mixed, 0, axes);
    connect(axes, 0, stays);
    connect(stays, 0, last);
  }
};
