//===- uniform_reyes.h - Reyes as one writes it first -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The example's renderer with a dicer that knows nothing of a piece's
// neighbours: a grid of equal cells, whose normals are those at its vertices.
//
//===----------------------------------------------------------------------===//
#ifndef UNITTESTS_FAILURES_UNIFORM_REYES_H
#define UNITTESTS_FAILURES_UNIFORM_REYES_H

#include "reyes/reyes.piko.cpp"

namespace uniform {

using namespace reyes;

// Evaluates a grid of as many equal cells as suffice for this piece.
struct UniformDice : piko::Stage<0, 0, 64, Grid, Micropolygon>,
                     piko::Uses<State> {
  void process(const Grid &g) {
    View view(state().camera, domain(), state().rate);
    const Patch &patch = state().patches[g.piece.patch];
    Parameter stepU = (whole >> g.piece.halvingsU) >> g.cellsU;
    Parameter stepV = (whole >> g.piece.halvingsV) >> g.cellsV;
    parallelFor(1 << g.cellsU, [&](int i) {
      Parameter u = g.piece.u + i * stepU;
      for (int j = 0; j < 1 << g.cellsV; ++j) {
        Parameter v = g.piece.v + j * stepV;
        Micropolygon m{};
        place(m, 0, patch, u, v, view);
        place(m, 1, patch, u + stepU, v, view);
        place(m, 2, patch, u + stepU, v + stepV, view);
        place(m, 3, patch, u, v + stepV, view);
        m.position *= 0.25f;
        m.normal = glm::normalize(m.normal);
        emit(m);
      }
    });
  }

private:
  void place(Micropolygon &m, int i, const Patch &patch, Parameter u,
             Parameter v, const View &view) {
    Curve line = alongV(patch, Weights(u, u));
    Curve slope = alongV(patch, SlopeWeights(u));
    glm::vec3 position = Weights(v, v).of(line);
    glm::vec3 normal = glm::normalize(
        glm::cross(Weights(v, v).of(slope), SlopeWeights(v).of(line)));
    bool turned = glm::dot(normal, state().camera.eye - position) < 0;
    m.position += position;
    m.normal += turned ? -normal : normal;
    glm::vec4 clip = view.project(position);
    glm::vec2 at = glm::vec2(clip) / clip.w;
    m.corners[i] = raster::snap(
        {view.half.x + at.x * view.half.x, view.half.y - at.y * view.half.y});
    m.depths[i] = clip.z / clip.w;
  }
};

// Takes a piece for as long on the screen as its corners are apart there.
struct CornerSplit : piko::Stage<0, 0, 64, Piece, Piece, Grid>,
                     piko::Uses<State> {
  void process(const Piece &p) {
    View view(state().camera, domain(), state().rate);
    Hull hull(state().patches[p.patch], p, view);
    if (hull.isOutside(view))
      return;
    glm::vec2 a = onScreen(hull, 0, view), b = onScreen(hull, 12, view);
    glm::vec2 c = onScreen(hull, 15, view), d = onScreen(hull, 3, view);
    int u = segments(a, b, d, c, view), v = segments(a, d, b, c, view);
    if (u <= gridBits && v <= gridBits)
      return emit(Grid{p, u, v}, 1);
    Piece first = p, second = p;
    if (u > v && p.halvingsU < maxHalvings) {
      second.halvingsU = ++first.halvingsU;
      second.u = first.endU();
    } else if (p.halvingsV < maxHalvings) {
      second.halvingsV = ++first.halvingsV;
      second.v = first.endV();
    } else {
      return;
    }
    emit(first, 0);
    emit(second, 0);
  }

private:
  static glm::vec2 onScreen(const Hull &hull, int i, const View &view) {
    return glm::vec2(hull.points[i]) / hull.points[i].w * view.half;
  }
  static int segments(glm::vec2 a, glm::vec2 b, glm::vec2 c, glm::vec2 d,
                      const View &view) {
    float length = glm::max(glm::distance(a, b), glm::distance(c, d));
    return ceilLog2(length / view.rate);
  }
};

template <class SplitStage> struct UniformReyes : piko::Pipe<State> {
  Load load;
  SplitStage split;
  UniformDice dice;
  Sample<Mapping{.bin = 32}> sample;
  Shade<Mapping{.bin = 32}> shade;

  UniformReyes() {
    source(load);
    connect(load, 0, split);
    connect(split, 0, split);
    connect(split, 1, dice);
    connect(dice, 0, sample);
    connect(sample, 0, shade);
    allocateForSource(state().undrawn, 0);
  }
};

} // namespace uniform

#endif // UNITTESTS_FAILURES_UNIFORM_REYES_H
