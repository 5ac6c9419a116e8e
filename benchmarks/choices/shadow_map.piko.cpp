// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/shadow with a square map of any size, of which each cell of the
// domain has a block of texels, and with other biases.
#include "shadow/shadow.piko.cpp"

#include <bit>

namespace shadow {

/// A block of Side by Side texels, as bits of how much nearer than the far
/// plane something is in z / w; the bits of positive numbers are ordered as
/// they are.
template <int Side> struct Texels {
  uint32_t nearness[Side][Side] = {};
};

template <int Side> struct MapState : State {
  int32_t side = 1024; ///< of the map in texels; as many as there are, if fewer
  piko::Image<Texels<Side>> blocks;
};

template <int Side>
inline glm::ivec2 mapSize(const MapState<Side> &state, glm::ivec2 domain) {
  return glm::ivec2(glm::min(state.side, Side * glm::min(domain.x, domain.y)));
}

//===----------------------------------------------------------------------===//
// The map
//===----------------------------------------------------------------------===//

template <Mapping M, int Side>
struct DrawMap : piko::Stage<M.bin, M.bin, 64, LightTriangle>,
                 piko::Uses<MapState<Side>> {
  void assignBin(const LightTriangle &t) {
    raster::PixelBox box = polygon(t).box();
    this->assignToBoundingBox(t, cellOf(box.lo), cellOf(box.hi));
  }

  void process(const LightTriangle &t) {
    glm::ivec2 first = Side * this->binLo(), last = Side * this->binHi() - 1;
    polygon(t).rasterize(
        [&](glm::ivec2 lo, glm::ivec2 hi, auto f) {
          lo = glm::max(lo, first);
          hi = glm::min(hi, last);
          for (int y = lo.y; y <= hi.y; ++y)
            for (int x = lo.x; x <= hi.x; ++x)
              f(glm::ivec2(x, y));
        },
        [&](const raster::Sample &s) {
          glm::ivec2 cell = s.pixel / Side, at = s.pixel - Side * cell;
          // An update would read and write the whole block.
          piko::atomicMax(this->state().blocks(cell).nearness[at.y][at.x],
                          std::bit_cast<uint32_t>(glm::max(1 - s.depth, 0.0f)));
        });
  }

private:
  // All triangles are on the map; an empty box ends at texel -1.
  static glm::ivec2 cellOf(glm::ivec2 texel) {
    return (texel + Side) / Side - 1;
  }
  raster::ScreenPolygon polygon(const LightTriangle &t) {
    return raster::ScreenPolygon(t.clip[0], t.clip[1], t.clip[2],
                                 mapSize(this->state(), this->domain()), false);
  }
};

//===----------------------------------------------------------------------===//
// Biases
//===----------------------------------------------------------------------===//

/// Along the normal, as examples/shadow has it.
struct NormalOffset {
  static glm::vec3 lookup(const LightView &view, glm::vec3, glm::vec3 position,
                          glm::vec3 normal, float bias) {
    return view.lookup(position, normal, bias);
  }
};

/// Towards the light, by as much as the surface falls away in so many texels.
/// There is no end to that at grazing angles.
struct SlopeScaled {
  static glm::vec3 lookup(const LightView &view, glm::vec3 toLight,
                          glm::vec3 position, glm::vec3 normal, float bias) {
    LightAxes axes(toLight);
    glm::vec3 n = glm::abs(axes.along(normal));
    float slope = glm::dot(glm::vec2(n), view.texelSize()) / n.z;
    return view.lookup(position + axes.z * (bias * slope), normal, 0);
  }
};

/// Towards the light, by so many texels' width.
struct Constant {
  static glm::vec3 lookup(const LightView &view, glm::vec3 toLight,
                          glm::vec3 position, glm::vec3 normal, float bias) {
    glm::vec2 texel = view.texelSize();
    float lift = bias * glm::max(texel.x, texel.y);
    return view.lookup(position + glm::normalize(toLight) * lift, normal, 0);
  }
};

template <Mapping M, int Side, class Bias>
struct SunShader : piko::Stage<M.bin, M.bin, 64, Fragment, ShadedFragment>,
                   piko::Uses<MapState<Side>> {
  void assignBin(const Fragment &f) { this->assignToPreviousBins(f); }
  void schedule(piko::BinId) { this->template endStage<DrawMap<M, Side>>(); }

  void process(const Fragment &f) {
    glm::vec3 n = glm::normalize(f.normal);
    glm::vec3 sum(this->state().settings.ambient);
    int64_t sun = findSun(this->state().lights);
    for (int64_t i = 0; i < this->state().lights.size(); ++i) {
      const Light &light = this->state().lights[i];
      float visible = i == sun ? visibility(f.position, n, light.position) : 1;
      sum += visible * raster::irradiance(light, f.position, n);
    }
    this->emit({f.pixel, f.depth, this->state().settings.albedo * sum});
  }

private:
  float visibility(glm::vec3 position, glm::vec3 normal, glm::vec3 toLight) {
    if (!(glm::dot(normal, toLight) > 0))
      return 0; // turned away
    glm::ivec2 size = mapSize(this->state(), this->domain());
    LightView view(toLight, this->state().reach[0], size);
    glm::vec3 at =
        Bias::lookup(view, toLight, position, normal, this->state().bias);
    return filterShadow(
        glm::vec2(at), this->state().texels, [&](glm::ivec2 texel) {
          return glm::any(glm::lessThan(texel, glm::ivec2(0))) ||
                 glm::any(glm::greaterThanEqual(texel, size)) ||
                 1 - at.z >= nearnessAt(texel);
        });
  }

  float nearnessAt(glm::ivec2 texel) {
    glm::ivec2 cell = texel / Side, at = texel - Side * cell;
    return std::bit_cast<float>(
        this->state().blocks(cell).nearness[at.y][at.x]);
  }
};

template <Mapping M, int Side, class Bias>
struct SquareMap : piko::Pipe<MapState<Side>> {
  Fit fit;
  VertexShader vertexShader;
  Project project;
  DrawMap<M, Side> drawMap;
  Rasterizer<M> rasterizer;
  SunShader<M, Side, Bias> fragmentShader;
  DepthTest<M> depthTest;

  SquareMap() {
    this->source(fit);
    this->source(vertexShader);
    this->source(project);
    this->source(rasterizer);
    this->connect(project, 0, drawMap);
    this->connect(rasterizer, 0, fragmentShader);
    this->connect(fragmentShader, 0, depthTest);
    this->allocateForSource(this->state().reach, 0);
    this->allocateForSource(this->state().vertices, 1);
  }
};

template <int Side, class Bias = NormalOffset>
struct Map : SquareMap<{.bin = 32, .apart = false}, Side, Bias> {};
// Of images that are at least 480 pixels high, for the size after the name.
struct Map256 : Map<1> {};
struct Map512 : Map<2> {};
struct Map1024 : Map<3> {};
struct Map2048 : Map<5> {};
struct Map4096 : Map<9> {};
struct Map8192 : Map<18> {};
struct SlopeScaled1024 : Map<3, SlopeScaled> {};
struct Constant1024 : Map<3, Constant> {};

} // namespace shadow
