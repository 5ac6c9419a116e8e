//===- light_view.h - The scene as a light sees it ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The map of a light that shines from a direction: a parallel projection that
// holds the whole scene and is as large as the image.
//
// Which surface is next to the light is known at the centres of texels only. A
// lookup compares the depth of a point with texels up to 1.5 texels away, where
// the surface itself, if it is slanted, may be nearer to the light than at the
// point: it would put itself in the shade (acne). Therefore the point is first
// lifted off its surface, by h along the normal n (z being towards the light).
// It is then h / n.z nearer to the light than a plane there, whose depth
// changes by n.x / n.z along x and by n.y / n.z along y. So
//
//   h = 1.5 (|n.x| texel.x + |n.y| texel.y)
//
// is exactly enough on a plane, at any angle, and less than 2.2 texels; no
// shadow comes loose from its object by more (peter-panning). A little is added
// for surfaces that are rough. With 1/8 texel, of 254,990 lit pixels of a bunny
// on the ground in 800 x 600 pixels, 33 are darker than they and their
// neighbours are with a map of 3200 x 2400 texels. Without a lift 98 % are.
//
//===----------------------------------------------------------------------===//
#ifndef SHADOW_LIGHT_VIEW_H
#define SHADOW_LIGHT_VIEW_H

#include <piko.h>
#include <piko/scene.h>

#include "../common/clip.h"

namespace shadow {

/// The first light that shines from a direction; -1 if there is none.
inline int64_t findSun(const piko::Buffer<piko::scene::Light> &lights) {
  for (int64_t i = 0; i < lights.size(); ++i)
    if (lights[i].position.w == 0)
      return i;
  return -1;
}

/// A box along the light's axes.
struct Box {
  glm::vec3 lo{raster::largestCoordinate};
  glm::vec3 hi{-raster::largestCoordinate};
};

inline Box unite(const Box &a, const Box &b) {
  return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)};
}

/// x and y along the map, z towards the light.
struct LightAxes {
  glm::vec3 x, y, z;

  explicit LightAxes(glm::vec3 toLight) {
    glm::vec3 aside =
        glm::abs(toLight.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    z = glm::normalize(toLight);
    x = glm::normalize(glm::cross(aside, z));
    y = glm::cross(z, x);
  }

  glm::vec3 along(glm::vec3 v) const {
    return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)};
  }

  /// The box of a vertex; empty if it is not finite.
  Box boxOf(glm::vec3 position) const {
    glm::vec3 p = along(position);
    return raster::isUsable(glm::vec4(p, 1)) ? Box{p, p} : Box{};
  }
};

/// From the world to the map.
class LightView {
public:
  LightView(glm::vec3 toLight, const Box &scene, glm::ivec2 size)
      : axes(toLight), middle((scene.lo + scene.hi) * 0.5f), size(size) {
    glm::vec3 extent = (scene.hi - scene.lo) * 0.5f;
    // A margin, and no extent of 0 if the scene is flat.
    half = extent * 1.01f +
           0.001f * piko::max(extent.x, piko::max(extent.y, extent.z));
  }

  /// A point in clip space.
  glm::vec4 clip(glm::vec3 position) const {
    glm::vec3 p = (axes.along(position) - middle) / half;
    return {p.x, p.y, -p.z, 1};
  }

  /// The place on the map, in texels, and the depth of a point on a surface
  /// with this normal, which faces the light: of one so many texels' slope
  /// above it.
  glm::vec3 lookup(glm::vec3 position, glm::vec3 normal, float bias) const {
    glm::vec3 n = glm::abs(axes.along(normal));
    glm::vec2 texel = texelSize();
    float lift = bias * (n.x * texel.x + n.y * texel.y) +
                 roughness * piko::max(texel.x, texel.y);
    glm::vec4 p = clip(position + lift * normal);
    glm::vec2 center = glm::vec2(size) * 0.5f;
    return {center.x + p.x * center.x, center.y - p.y * center.y, p.z};
  }

  /// How wide and how high a texel is in the world.
  glm::vec2 texelSize() const {
    return 2.0f * glm::vec2(half) / glm::vec2(size);
  }

private:
  static constexpr float roughness = 1.0f / 8;

  LightAxes axes;
  glm::vec3 middle, half;
  glm::ivec2 size;
};

/// Percentage-closer filtering (Reeves, Salesin and Cook 1987): how much of a
/// square of 2 * reach texels a side about a place on the map is lit; at a
/// reach of 0, whether the texel there is.
template <class IsLit>
float filterShadow(glm::vec2 place, int reach, IsLit isLit) {
  glm::vec2 corner = glm::floor(place), part = place - corner;
  glm::ivec2 center(piko::toInt(corner.x), piko::toInt(corner.y));
  if (reach == 0)
    return isLit(center) ? 1.0f : 0.0f;
  // How much of the square lies in a column or row of texels so many steps
  // beside its centre's, in which the centre has passed `part` of a texel.
  auto overlap = [&](int step, float part) {
    return step == -reach ? 1 - part : step == reach ? part : 1;
  };
  float lit = 0;
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x)
      if (isLit(center + glm::ivec2(x, y)))
        lit += overlap(x, part.x) * overlap(y, part.y);
  float side = float(2 * reach);
  return lit / (side * side);
}

} // namespace shadow

#endif // SHADOW_LIGHT_VIEW_H
