//===- reyes.piko.cpp - A Reyes renderer of bicubic patches ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//                    +----+
//                    v    | 0
//   patches --> Load --> Split --1--> Dice --> Sample --> Shade
//
// Split halves what is too large on the screen for one grid; Dice makes a grid
// of micropolygons, each about as large as a pixel (Cook, Carpenter and
// Catmull 1987); Sample finds the pixels that they cover; Shade lights them and
// keeps the nearest. Edges are the same for all that share them, see dicing.h.
//
//===----------------------------------------------------------------------===//
#include <piko.h>
#include <piko/scene.h>

#include "../common/coverage.h"
#include "../common/lighting.h"
#include "../common/mapping.h"
#include "dicing.h"

using namespace piko::scene;

namespace reyes {

using raster::Mapping;

using raster::PixelBox;
using raster::Point;

/// A piece that is small enough, and the logarithms of the cells that suffice.
struct Grid {
  Piece piece;
  int32_t cellsU, cellsV;
};

/// A quadrilateral on the screen: the triangles 0 1 2 and 0 2 3.
struct Micropolygon {
  Point corners[4];
  float depths[4];    ///< z / w
  glm::vec3 position; ///< of its middle
  glm::vec3 normal;   ///< of unit length, towards the eye
};

struct Fragment {
  glm::ivec2 pixel;
  float depth;
  glm::vec3 position;
  glm::vec3 normal;
};

struct Depth {
  float z = 1; // the far plane
};

struct State {
  Camera camera;
  Settings settings;
  float rate = 1; ///< pixels that an edge of a micropolygon may be long
  piko::Buffer<Light> lights;
  piko::Buffer<Patch> patches;
  /// How many pieces of each patch are not in the picture, because halving
  /// them maxHalvings times did not make them small enough, or because a
  /// control point is no number.
  piko::Buffer<Counter> undrawn;
  piko::Image<Depth> depth;
  piko::Image<Color> color;
};

// Makes each patch its own first piece.
struct Load : piko::Stage<0, 0, 64, Patch, Piece>, piko::Uses<State> {
  void process(const Patch &p) {
    bool isUsable = true;
    for (int i = 0; i < 16; ++i) {
      glm::vec3 size = glm::abs(p.points[i]);
      isUsable &= size.x <= 1e15f && size.y <= 1e15f && size.z <= 1e15f;
    }
    if (isUsable)
      emit(Piece{p.index, 0, 0, 0, 0});
    else
      piko::atomicAdd(state().undrawn[p.index].count, 1);
  }
};

// Culls what is out of view, and halves what is too large for a grid.
struct Split : piko::Stage<0, 0, 64, Piece, Piece, Grid>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }

  void process(const Piece &p) {
    View view(state().camera, domain(), state().rate);
    const Patch &patch = state().patches[p.patch];
    Hull hull(patch, p, view);
    if (hull.isOutside(view))
      return;

    // Borders are measured as Dice does, which counts to the last bit.
    int u = hull.segmentsU(view), v = hull.segmentsV(view);
    u = piko::max(u, borderU(patch, p, p.v, view));
    u = piko::max(u, borderU(patch, p, p.endV(), view));
    v = piko::max(v, borderV(patch, p, p.u, view));
    v = piko::max(v, borderV(patch, p, p.endU(), view));
    if (u <= gridBits && v <= gridBits)
      return emit(Grid{p, u, v}, 1);

    bool mayU = u > gridBits && p.halvingsU < maxHalvings;
    bool mayV = v > gridBits && p.halvingsV < maxHalvings;
    if (!mayU && !mayV) {
      piko::atomicAdd(state().undrawn[p.patch].count, 1);
      return;
    }
    // Where both are unknown, the one that was halved less.
    bool along = u != v ? u > v : p.halvingsU <= p.halvingsV;
    Piece first = p, second = p;
    if (mayU && (along || !mayV)) {
      second.halvingsU = ++first.halvingsU;
      second.u = first.endU();
    } else {
      second.halvingsV = ++first.halvingsV;
      second.v = first.endV();
    }
    emit(first, 0);
    emit(second, 0);
  }

private:
  int borderU(const Patch &patch, const Piece &p, Parameter v,
              const View &view) {
    Curve line = alongU(patch, Weights(v, v));
    return segmentsOf(partOf(line, p.u, p.endU()), view);
  }
  int borderV(const Patch &patch, const Piece &p, Parameter u,
              const View &view) {
    Curve line = alongV(patch, Weights(u, u));
    return segmentsOf(partOf(line, p.v, p.endV()), view);
  }
};

// Evaluates a grid and emits its micropolygons.
struct Dice : piko::Stage<0, 0, 64, Grid, Micropolygon>, piko::Uses<State> {
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }

  void process(const Grid &g) {
    View view(state().camera, domain(), state().rate);
    const Patch &patch = state().patches[g.piece.patch];
    Lattice lattice(patch, g, view);
    int cellsU = lattice.cellsU, cellsV = lattice.cellsV;

    Vertex vertices[side * side];
    parallelFor(cellsU + 1, [&](int i) {
      Parameter u = lattice.piece.u + i * lattice.stepU;
      Curve line = alongV(patch, Weights(u, u));
      for (int j = 0; j <= cellsV; ++j) {
        Place p = lattice.corner(i, j);
        vertices[side * i + j] =
            p.u == u ? vertexAt(line, p.v, view) : vertexAt(patch, p, view);
      }
    });
    parallelFor(cellsU, [&](int i) {
      Parameter u = lattice.middleU(i);
      Curve line = alongV(patch, Weights(u, u));
      Curve slope = alongV(patch, SlopeWeights(u));
      for (int j = 0; j < cellsV; ++j) {
        const Vertex *first = &vertices[side * i + j];
        const Vertex *second = first + side;
        Micropolygon m;
        m.corners[0] = first[0].at;
        m.corners[1] = second[0].at;
        m.corners[2] = second[1].at;
        m.corners[3] = first[1].at;
        m.depths[0] = first[0].depth;
        m.depths[1] = second[0].depth;
        m.depths[2] = second[1].depth;
        m.depths[3] = first[1].depth;
        emitAt(m, line, slope, lattice.middleV(j));
      }
    });

    // What a corner leaves open between the lines that meet there.
    for (int k = 0; k < 4; ++k) {
      int i = k < 2 ? 0 : cellsU, j = k % 2 == 0 ? 0 : cellsV;
      Place own = lattice.corner(i, j), other = lattice.cornerAlongU(i, j);
      if (own.u == other.u && own.v == other.v)
        continue;
      int next = i == 0 ? 1 : cellsU - 1;
      Vertex a = vertexAt(patch, own, view), b = vertexAt(patch, other, view);
      Vertex c = vertexAt(patch, lattice.corner(next, j), view);
      bool isTurned = (i == 0) != (j == 0); // as the cells are on these sides
      Vertex first = isTurned ? c : a, last = isTurned ? a : c;
      Micropolygon m;
      m.corners[0] = first.at;
      m.corners[1] = b.at;
      m.corners[2] = m.corners[3] = last.at;
      m.depths[0] = first.depth;
      m.depths[1] = b.depth;
      m.depths[2] = m.depths[3] = last.depth;
      Parameter u = lattice.middleU(piko::min(i, cellsU - 1));
      emitAt(m, alongV(patch, Weights(u, u)), alongV(patch, SlopeWeights(u)),
             lattice.middleV(piko::min(j, cellsV - 1)));
    }
  }

private:
  static constexpr int side = (1 << gridBits) + 1;

  struct Vertex {
    Point at;
    float depth;
  };
  struct Place {
    Parameter u, v;
  };

  /// Where the corners of a grid's cells are.
  struct Lattice {
    Piece piece;
    int cellsU, cellsV;
    Parameter stepU, stepV;
    /// The segments of the lines that bound the piece.
    Parameter segmentsAtU[2], segmentsAtV[2];

    Lattice(const Patch &patch, const Grid &g, const View &view)
        : piece(g.piece) {
      Parameter u0 = piece.u, u1 = piece.endU();
      Parameter v0 = piece.v, v1 = piece.endV();
      int hu = piece.halvingsU, hv = piece.halvingsV;
      segmentsAtU[0] =
          segmentLength(alongV(patch, Weights(u0, u0)), v0, hv, view);
      segmentsAtU[1] =
          segmentLength(alongV(patch, Weights(u1, u1)), v0, hv, view);
      segmentsAtV[0] =
          segmentLength(alongU(patch, Weights(v0, v0)), u0, hu, view);
      segmentsAtV[1] =
          segmentLength(alongU(patch, Weights(v1, v1)), u0, hu, view);
      stepU = piko::min((u1 - u0) >> g.cellsU,
                        piko::min(segmentsAtV[0], segmentsAtV[1]));
      stepV = piko::min((v1 - v0) >> g.cellsV,
                        piko::min(segmentsAtU[0], segmentsAtU[1]));
      cellsU = (u1 - u0) / stepU;
      cellsV = (v1 - v0) / stepV;
    }

    /// The corner i, j of the cells. Those of the whole grid are taken to
    /// belong to the lines of constant u.
    Place corner(int i, int j) const {
      Place p{piece.u + i * stepU, piece.v + j * stepV};
      if (i == 0 || i == cellsU)
        p.v = snapTo(segmentsAtU[i != 0], p.v);
      else if (j == 0 || j == cellsV)
        p.u = snapTo(segmentsAtV[j != 0], p.u);
      return p;
    }
    /// A corner of the whole grid where the line of constant v has it.
    Place cornerAlongU(int i, int j) const {
      return {snapTo(segmentsAtV[j != 0], piece.u + i * stepU),
              piece.v + j * stepV};
    }
    /// Middles of cells.
    Parameter middleU(int i) const {
      return piece.u + i * stepU + (stepU >> 1);
    }
    Parameter middleV(int j) const {
      return piece.v + j * stepV + (stepV >> 1);
    }
  };

  Vertex vertexAt(const Curve &line, Parameter v, const View &view) {
    glm::vec4 clip = view.project(Weights(v, v).of(line));
    float inverse = 1 / clip.w;
    glm::vec2 half = view.half;
    return {raster::snap({half.x + clip.x * inverse * half.x,
                          half.y - clip.y * inverse * half.y}),
            clip.z * inverse};
  }
  Vertex vertexAt(const Patch &patch, Place p, const View &view) {
    return vertexAt(alongV(patch, Weights(p.u, p.u)), p.v, view);
  }

  /// Emits a micropolygon if it may be seen. Its middle is at v of a line of
  /// constant u, and `slope` is the derivative of that line by u.
  void emitAt(Micropolygon &m, const Curve &line, const Curve &slope,
              Parameter v) {
    PixelBox box = boxOf(m);
    glm::ivec2 size = domain();
    if (box.lo.x > box.hi.x || box.lo.y > box.hi.y || box.hi.x < 0 ||
        box.hi.y < 0 || box.lo.x >= size.x || box.lo.y >= size.y)
      return;
    Weights atV(v, v);
    m.position = atV.of(line);
    glm::vec3 normal = glm::cross(atV.of(slope), SlopeWeights(v).of(line));
    glm::vec3 toEye = state().camera.eye - m.position;
    float length = piko::sqrt(glm::dot(normal, normal));
    if (!(length > 0)) { // the patch is degenerate there
      normal = toEye;
      length = piko::sqrt(glm::dot(normal, normal));
    }
    float sign = glm::dot(normal, toEye) < 0 ? -1.0f : 1.0f;
    m.normal = normal * (sign / length);
    emit(m);
  }

public:
  static PixelBox boxOf(const Micropolygon &m) {
    Point lo = m.corners[0], hi = lo;
    for (int i = 1; i < 4; ++i) {
      Point p = m.corners[i];
      lo = {piko::min(lo.x, p.x), piko::min(lo.y, p.y)};
      hi = {piko::max(hi.x, p.x), piko::max(hi.y, p.y)};
    }
    return raster::pixelsBetween(lo, hi);
  }
};

// Finds the pixels that a micropolygon covers.
template <Mapping M>
struct Sample : piko::Stage<M.bin, M.bin, 64, Micropolygon, Fragment>,
                piko::Uses<State> {
  void assignBin(const Micropolygon &m) {
    PixelBox box = Dice::boxOf(m);
    this->assignToBoundingBox(m, box.lo, box.hi);
  }
  void schedule(piko::BinId) { this->specifySchedule(M.core, M.split); }

  void process(const Micropolygon &m) {
    PixelBox box = Dice::boxOf(m);
    // Once for both triangles.
    box.lo = glm::max(box.lo, this->binLo());
    box.hi = glm::min(box.hi, this->binHi() - 1);
    sample(m, 1, 2, box);
    sample(m, 2, 3, box);
  }

private:
  /// The triangle of corner 0 and two others, from both sides.
  void sample(const Micropolygon &m, int i, int j, PixelBox box) {
    int64_t area = raster::signedArea(m.corners[0], m.corners[i], m.corners[j]);
    if (area == 0)
      return;
    int second = area > 0 ? i : j, third = area > 0 ? j : i;
    raster::Edges edges(m.corners[0], m.corners[second], m.corners[third]);
    float inverse = 1.0f / float(glm::abs(area));
    this->parallelForPixels(box.lo, box.hi, [&](glm::ivec2 p) {
      int64_t v0 = edges.e0.at(p.x, p.y), v1 = edges.e1.at(p.x, p.y),
              v2 = edges.e2.at(p.x, p.y);
      if (!edges.e0.holds(v0) || !edges.e1.holds(v1) || !edges.e2.holds(v2))
        return;
      float depth = (float(v0) * m.depths[0] + float(v1) * m.depths[second] +
                     float(v2) * m.depths[third]) *
                    inverse;
      if (depth >= -1) // beyond the near plane
        this->emit(Fragment{p, depth, m.position, m.normal});
    });
  }
};

// Sums up the lights at the fragments that are nearer than all before them.
template <Mapping M>
struct Shade : piko::Stage<M.bin, M.bin, 64, Fragment>, piko::Uses<State> {
  void assignBin(const Fragment &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) {
    if constexpr (M.apart)
      this->specifySchedule(M.rest, M.split);
  }

  void process(const Fragment &f) {
    bool isNearest =
        this->update(this->state().depth, f.pixel, [&](Depth &nearest) {
          bool passed = f.depth < nearest.z;
          if (passed)
            nearest.z = f.depth;
          return passed;
        });
    if (!isNearest)
      return;
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i)
      sum += raster::irradiance(this->state().lights[i], f.position, f.normal);
    this->update(this->state().color, f.pixel, [&](Color &c) {
      c.rgba = glm::vec4(this->state().settings.albedo * sum, 1);
    });
  }
};

template <Mapping M> struct MappedReyes : piko::Pipe<State> {
  Load load;
  Split split;
  Dice dice;
  Sample<M> sample;
  Shade<M> shade;

  MappedReyes() {
    source(load);
    connect(load, 0, split);
    connect(split, 0, split);
    connect(split, 1, dice);
    connect(dice, 0, sample);
    connect(sample, 0, shade);
    allocateForSource(this->state().undrawn, 0);
  }
};

struct Reyes : MappedReyes<{.bin = piko::tunable("tile", 32, 16, 64),
                            .rest = piko::DirectMap}> {};

} // namespace reyes
