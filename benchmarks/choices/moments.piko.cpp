// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/oit with moment-based order-independent transparency (Muenstermann,
// Krumpen, Klein and Peters 2018): how much light reaches a layer is estimated
// from four power moments of the absorbance along the ray, in whatever order
// layers come.
#include "oit/oit.piko.cpp"

namespace oit {

/// Sums of absorbance (minus the logarithm of transmittance) times powers of
/// depth, from the 0th to the 4th.
struct Moments {
  float power[5] = {};
};

struct MomentSums {
  glm::vec4 rgba = glm::vec4(0); ///< of layers, as far as they are seen
};

struct MomentState : State {
  piko::Image<Moments> moments;
  piko::Image<MomentSums> sums;
};

/// A layer of 1 would hide all absorbance after it.
inline float absorbanceOf(float alpha) {
  return -piko::log(1 - glm::min(alpha, 0.99999f));
}

/// From -1 at the near plane to 1 at the far one, by the logarithm of distance,
/// in which layers are about as far apart everywhere.
inline float warp(const Camera &c, float depth) {
  float inverse =
      0.5f * ((1 + depth) / c.farZ + (1 - depth) / c.nearZ); // of distance
  float along = piko::log(c.nearZ * inverse) / piko::log(c.nearZ / c.farZ);
  return glm::clamp(2 * along - 1, -1.0f, 1.0f);
}

/// The greatest and the least of what distributions with given moments may have
/// below a depth z. Both are of the distribution that has three depths: z and
/// the roots of the polynomial that is orthogonal to all of lower degree.
class MomentBounds {
public:
  explicit MomentBounds(const Moments &moments) {
    // Rounded moments may be of no distribution: a little of one that has
    // depths everywhere makes up for that.
    constexpr float bias = 5e-7f;
    constexpr float center[5] = {1, 0, 0.375f, 0, 0.375f};
    for (int i = 0; i < 5; ++i)
      m[i] =
          (1 - bias) * (moments.power[i] / moments.power[0]) + bias * center[i];
  }

  /// The share of absorbance before z, with `part` of what may be at z.
  float before(float z, float part) const {
    // c is the solution of H c = (1, z, z^2), H being the Hankel matrix of the
    // moments, by its LDL' decomposition.
    float d1 = m[2] - m[1] * m[1], l21 = (m[3] - m[1] * m[2]) / d1;
    float d2 = m[4] - m[2] * m[2] - d1 * l21 * l21;
    float y1 = z - m[1], y2 = z * z - m[2] - l21 * y1;
    float c2 = y2 / d2, c1 = y1 / d1 - l21 * c2;
    float c0 = 1 - m[1] * c1 - m[2] * c2;
    float atZ = 1 / (c0 + z * (c1 + z * c2));
    // The other two depths are the roots of c0 + c1 x + c2 x^2.
    float middle = -0.5f * c1 / c2;
    float root = piko::sqrt(glm::max(middle * middle - c0 / c2, 0.0f));
    float x1 = middle - root, x2 = middle + root;
    // Their weights make up the rest of the moments 0 and 1.
    float rest = 1 - atZ;
    float at2 = (m[1] - z * atZ - x1 * rest) / (x2 - x1);
    float at1 = rest - at2;
    float share = part * atZ + (x1 < z ? at1 : 0) + (x2 < z ? at2 : 0);
    return share > 0 ? glm::min(share, 1.0f) : 0; // of NaN 0
  }

private:
  float m[5];
};

template <Mapping M>
struct MomentBlend : piko::Stage<M.bin, M.bin, 64, Layer>,
                     piko::Uses<MomentState> {
  void assignBin(const Layer &l) {
    this->assignToBin(l, this->binFromPosition(l.pixel));
  }
  void schedule(piko::BinId) { this->endBin(); }

  void process(const piko::List<Layer> &layers) {
    for (const Layer &l : layers) {
      float absorbance = absorbanceOf(l.rgba.a);
      float z = warp(this->state().camera, l.depth);
      this->update(this->state().moments, l.pixel, [&](Moments &sums) {
        float power = absorbance;
        for (int i = 0; i < 5; ++i, power *= z)
          sums.power[i] += power;
      });
    }
    for (const Layer &l : layers) {
      // Between the bounds, nearer to that which takes too much for seen.
      constexpr float part = 0.1f;
      const Moments &moments = this->state().moments(l.pixel);
      float z = warp(this->state().camera, l.depth);
      float share = MomentBounds(moments).before(z, part);
      float seen = piko::exp(-moments.power[0] * share);
      this->update(this->state().sums, l.pixel,
                   [&](MomentSums &sums) { sums.rgba += seen * l.rgba; });
    }
    this->parallelForPixels([&](glm::ivec2 p) {
      glm::vec4 sum = this->state().sums(p).rgba;
      if (!(sum.a > 0))
        return;
      float through = piko::exp(-this->state().moments(p).power[0]);
      glm::vec3 mean = glm::vec3(sum) / sum.a;
      this->update(this->state().color, p, [&](Color &c) {
        c.rgba =
            glm::vec4(mean * (1 - through) + glm::vec3(c.rgba) * through, 1);
      });
    });
  }
};

struct MomentOit : piko::Pipe<MomentState> {
  static constexpr Mapping bins16 = {.bin = 16, .apart = false};
  VertexShader vertexShader;
  Rasterizer<bins16> rasterizer;
  FragmentShader<bins16> fragmentShader;
  MomentBlend<bins16> blend;

  MomentOit() {
    source(vertexShader);
    source(rasterizer);
    connect(rasterizer, 0, fragmentShader);
    connect(fragmentShader, 0, blend);
    allocateForSource(state().vertices, 0);
  }
};

} // namespace oit
