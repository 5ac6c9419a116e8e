// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What C++ a phase may be written in: templates, helpers, lambdas, if constexpr,
// early returns, switches that fall through, nested loops with two exits, arrays
// inside primitives with constant and dynamic indices, GLM.
// RUN: %compare_targets %s --count 4000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

struct Patch {
  glm::vec3 corner[4];
  float weight[4];
  int kind;
  bool flag;
};
struct Matrix {
  glm::mat4 rows;
  float bias[3];
};
struct Result {
  int code, most;
};
struct State {
  Matrix matrix;
  piko::Buffer<Result> results;
};

template <class T, int N> T sumOf(const T (&values)[N]) {
  T total = values[0];
  for (int i = 1; i < N; ++i)
    total = total + values[i];
  return total;
}

inline int classify(const Patch &p) {
  if (p.flag)
    return -1;
  int code = 0;
  switch (p.kind % 6) {
  case 0:
    code += 1;
    [[fallthrough]];
  case 1:
    code += 10;
    break;
  case 2:
    return 1000;
  case 4:
    code += 7;
    break;
  default:
    code -= 3;
  }
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      if (i * j == p.kind)
        return code * 2;
      if (j > p.kind % 5)
        break;
      if ((i + j) % 3 == 0)
        continue;
      code += j;
    }
    if (code > 60)
      break;
  }
  return code;
}

template <bool Scale>
struct Turn : piko::Stage<0, 0, 64, Patch, Patch>, piko::Uses<State> {
  void process(const Patch &p) {
    const Matrix &m = state().matrix;
    Patch q = p;
    auto turn = [&](glm::vec3 v) {
      glm::vec4 r = m.rows * glm::vec4(v, 1.0f);
      return glm::vec3(r) / (1.0f + r.w * r.w);
    };
    for (int i = 0; i < 4; ++i) {
      q.corner[(i + p.kind) % 4] = turn(p.corner[i]);
      if constexpr (Scale)
        q.weight[i] = p.weight[3 - i] * m.bias[i % 3];
    }
    if (q.kind == 3)
      return;
    emit(q, 0);
  }
};
struct Store : piko::Stage<0, 0, 64, Patch>, piko::Uses<State> {
  void process(const Patch &p) {
    glm::vec3 middle = sumOf(p.corner) * 0.25f;
    float sorted[4];
    for (int i = 0; i < 4; ++i) {
      int j = i;
      for (; j > 0 && sorted[j - 1] > p.weight[i]; --j)
        sorted[j] = sorted[j - 1];
      sorted[j] = p.weight[i];
    }
    float a[4];
    for (int i = 0; i < 4; ++i)
      a[i] = sorted[i] + glm::dot(middle, glm::normalize(p.corner[i] + 100.0f));
    piko::atomicAdd(state().results[p.kind].code, classify(p));
    if (p.weight[0] == sorted[0] && p.flag)
      piko::atomicMax(state().results[(p.kind + 7) % 64].most,
                      int(glm::max(a[2], 0.0f) * 16.0f));
  }
};
struct Features : piko::Pipe<State> {
  Turn<true> turn;
  Turn<false> again;
  Store store;
  Features() {
    source(turn);
    connect(turn, 0, again);
    connect(again, 0, store);
  }
};
