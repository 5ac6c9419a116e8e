// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Camera rays as examples/raytrace follows them, several for each pixel.
#include "raytrace/raytrace.piko.cpp"

#include <bit>

namespace raytrace {

/// The standard multisample patterns of Direct3D 11, from the pixel's centre in
/// 1/16 pixel (D3D11_STANDARD_MULTISAMPLE_PATTERN).
template <int Count> struct RotatedGrid {
  static glm::vec2 at(int i) {
    constexpr int8_t two[][2] = {{4, 4}, {-4, -4}};
    constexpr int8_t four[][2] = {{-2, -6}, {6, -2}, {-6, 2}, {2, 6}};
    constexpr int8_t eight[][2] = {{1, -3}, {-1, 3},  {5, 1}, {-3, -5},
                                   {-5, 5}, {-7, -1}, {3, 7}, {7, -7}};
    constexpr int8_t sixteen[][2] = {{1, 1},   {-1, -3}, {-3, 2},  {4, -1},
                                     {-5, -2}, {2, 5},   {5, 3},   {3, -5},
                                     {-2, 6},  {0, -7},  {-4, -6}, {-6, 4},
                                     {-8, 0},  {7, -4},  {6, 7},   {-7, -8}};
    const int8_t *p = Count == 2   ? two[i]
                      : Count == 4 ? four[i]
                      : Count == 8 ? eight[i]
                                   : sixteen[i];
    return glm::vec2(p[0], p[1]) / 16.0f + 0.5f;
  }
};

/// The first points of Sobol's sequence in two dimensions, in the middle of
/// their squares.
template <int Count> struct Sobol {
  static glm::vec2 at(int i) {
    uint32_t x = 0, y = 0, direction = 1u << 31;
    for (uint32_t bits = uint32_t(i), column = 1u << 31; bits != 0;
         bits >>= 1, column >>= 1) {
      if (bits & 1) {
        x ^= column;
        y ^= direction;
      }
      direction ^= direction >> 1;
    }
    return glm::vec2(float(x >> 8), float(y >> 8)) * 0x1p-24f +
           0.5f / float(Count);
  }
};

template <Mapping M, class Pattern, int Count>
struct SampledPixels : PacketStage<M, ShearedRay, Nothing> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) { this->everyBin(); }

  void process(const piko::List<Nothing> &) {
    constexpr int side = 4;
    glm::ivec2 lo = this->binLo(), hi = this->binHi();
    for (int y = lo.y; y < hi.y; y += side)
      for (int x = lo.x; x < hi.x; x += side)
        this->parallelFor(this->packet, [&](int i) {
          glm::ivec2 at(x + i % side, y + i / side);
          bool isPixel = glm::all(glm::lessThan(at, hi));
          glm::vec4 sum(0);
          for (int k = 0; k < Count; ++k)
            sum += colorAt(glm::vec2(at) + Pattern::at(k), isPixel);
          if (isPixel)
            this->update(this->state().image, at,
                         [&](Color &c) { c.rgba = sum / float(Count); });
        });
  }

private:
  glm::vec4 colorAt(glm::vec2 at, bool isPixel) {
    const Camera &c = this->state().camera;
    glm::vec2 size = this->domain();
    glm::vec3 direction = c.forward + c.right * (2 * at.x / size.x - 1) +
                          c.up * (1 - 2 * at.y / size.y);
    Hit hit = this->find(c.eye, direction, isPixel ? INFINITY : -1, false);
    if (hit.triangle < 0)
      return Color().rgba;
    const Triangle &t = this->state().triangles[hit.triangle];
    glm::vec3 normal(0);
    for (int i = 0; i < 3; ++i)
      normal += this->state().vertices[t.vertex[i]].normal * hit.weight[i];
    normal = glm::normalize(normal);
    glm::vec3 sum(this->state().settings.ambient);
    for (int64_t i = 0; i < this->state().lights.size(); ++i)
      sum += raster::irradiance(this->state().lights[i],
                                c.eye + direction * hit.t, normal);
    return glm::vec4(this->state().settings.albedo * sum, 1);
  }
};

template <class Pattern, int Count> struct Sampler : piko::Pipe<State> {
  SampledPixels<Mapping{.bin = 16}, Pattern, Count> pixels;
  Sampler() { source(pixels); }
};

} // namespace raytrace

template <int Count>
struct Rotated : raytrace::Sampler<raytrace::RotatedGrid<Count>, Count> {};
template <int Count>
struct Sequence : raytrace::Sampler<raytrace::Sobol<Count>, Count> {};
struct Samples1 : Sequence<1> {};
struct Rotated2 : Rotated<2> {};
struct Rotated4 : Rotated<4> {};
struct Rotated8 : Rotated<8> {};
struct Rotated16 : Rotated<16> {};
struct Sobol2 : Sequence<2> {};
struct Sobol4 : Sequence<4> {};
struct Sobol8 : Sequence<8> {};
struct Sobol16 : Sequence<16> {};
