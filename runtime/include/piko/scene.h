//===- piko/scene.h - Scene types that piko-render understands ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A pipeline that uses these types can be rendered by piko-render, which knows
// no pipeline by name and binds by type:
//
//   what the pipeline declares                what piko-render puts there
//   ----------------------------------------  ---------------------------------
//   a constant of type Camera                 the camera
//   a constant of type Settings               shading constants and switches
//   a constant of type Bounds                 the box of the mesh
//   a Buffer<Light>                           the lights
//   a Buffer<Vertex>, a Buffer<Triangle>      the mesh
//   a Buffer<Patch>                           the patches
//   a Buffer<BvhNode>, a Buffer<BvhTriangle>  a tree of boxes about it
//   a source into a stage that takes Vertex   the mesh's vertices, in order
//   a source into a stage that takes Triangle the mesh's triangles, in order
//   a source into a stage that takes Patch    the patches, in order
//   a source into a stage that takes Pixel    the image's pixels, row by row
//   a source into a stage that takes Nothing  nothing: its bins are all that a
//                                             stage with everyBin() takes
//   the Image<Color>                          the result: there is exactly one
//
// Each may occur any number of times (the Image<Color> once) or not at all. In
// the place of a scene there may be a table, NAME.csv, which has no camera,
// light or mesh: it feeds the one source of any other type, whose fields its
// first line names, a primitive of each further line.
//
// A host-bound buffer, a constant without a default value or a source of any
// other type is an error, because nothing could fill it. State that the
// pipeline allocates or clears itself and constants with a default value are
// left alone. The domain is the image: cell (0, 0) is its top left pixel.
//
// A scene has a mesh or patches. A Buffer<Counter> that the pipeline allocates
// is read after the last frame, and its sum, if not 0, is said to the user.
//
// All types are trivially copyable; lengths are in the scene's own unit.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_SCENE_H
#define PIKO_SCENE_H

#include <piko/macros_begin.h>

#include <stdint.h>

#include <glm/glm.hpp>

namespace piko::scene {

/// A pinhole camera.
///
/// The ray through image point (sx, sy), where sx runs from -1 at the left to
/// 1 at the right and sy from -1 at the bottom to 1 at the top, starts at `eye`
/// and has the direction `forward + right * sx + up * sy`.
struct Camera {
  /// World to clip space as in OpenGL: visible points have -w <= x, y, z <= w,
  /// and the near plane is z = -w. Column-major.
  glm::mat4 viewProjection;
  glm::vec3 eye;
  glm::vec3 forward; ///< unit length
  glm::vec3 right;   ///< half the image's width at distance 1
  glm::vec3 up;      ///< half the image's height at distance 1
  float nearZ;       ///< distance of the near plane along `forward`, above 0
  float farZ;        ///< distance of the far plane, beyond the scene
};

/// A light. It shines from `position.xyz`: a direction (towards the light,
/// unit length) if `position.w` is 0, a point if it is 1. It does not fall
/// off with distance.
struct Light {
  glm::vec4 position;
  glm::vec4 color; ///< linear rgb; w is unused
};

/// What to shade with, and switches. A surface with normal n at p has colour
///   albedo * (ambient + sum over lights of color * max(0, dot(n, l)) / |l|)
/// where l = position.xyz - position.w * p. Both sides of a surface have the
/// same normal.
struct Settings {
  float albedo = 0.8f;
  float ambient = 0.05f;
  /// Not 0: triangles whose corners run clockwise on the screen are left out.
  int32_t cullBackFaces = 0;
};

/// A corner that triangles share.
struct Vertex {
  glm::vec3 position;
  glm::vec3 normal; ///< unit length
  int32_t index;    ///< its own place among the vertices
};

/// Three vertices, counterclockwise where the front is seen.
struct Triangle {
  glm::ivec3 vertex; ///< places among the vertices
  int32_t index;     ///< its own place among the triangles
};

/// A bicubic Bezier patch: points[4 * i + j] is the control point i along u and
/// j along v.
struct Patch {
  glm::vec3 points[16];
  int32_t index; ///< its own place among the patches
};

/// What a pipeline tells of: how often something happened that the picture
/// does not show.
struct Counter {
  int32_t count = 0;
};

/// A pixel of the result: linear colour and coverage. Alpha is 0 where nothing
/// was drawn; a new image shows the background everywhere.
///
/// 8-bit images hold floor(255 * clamp(c, 0, 1) + 0.5) for each of r, g and b
/// (no transfer function) and no alpha; float images hold all four as they are.
struct Color {
  glm::vec4 rgba = {0.1f, 0.1f, 0.1f, 0.0f};
};

/// The same in four bytes: r in the lowest one, then g, b and alpha. A pipeline
/// whose result is of this kind moves a quarter of the memory.
struct Color8 {
  uint32_t rgba = 0x001a1a1a;
};

/// With channels as an 8-bit image of colours has them, alpha like the others;
/// those that are no numbers become 0.
inline Color8 toColor8(glm::vec4 color) {
  auto toByte = [](float channel) {
    float clamped = channel > 0 ? glm::min(channel, 1.0f) : 0.0f;
    return uint32_t(int32_t(clamped * 255 + 0.5f));
  };
  return {toByte(color.r) | toByte(color.g) << 8 | toByte(color.b) << 16 |
          toByte(color.a) << 24};
}

/// A pixel of the image, by its cell.
struct Pixel {
  glm::ivec2 at;
};

/// What no scene has: for a stage that runs when others are done, once for each
/// bin.
struct Nothing {};

/// The box that holds all triangles of a tree; 0 if there are none.
struct Bounds {
  glm::vec3 lo, hi;
};

/// How many children a node has, and how many nodes a path from the root.
constexpr int bvhWidth = 8, bvhDepth = 32;

/// A node of a tree of boxes about the triangles. Node 0 is the root; a tree
/// without triangles has no node.
struct BvhNode {
  /// The children's boxes: least x, y and z, then greatest x, y and z. Where
  /// there is no child, the least is infinity and the greatest -infinity.
  float bounds[6][bvhWidth];
  int32_t child[bvhWidth]; ///< the child's place among the nodes, or, of a
                           ///< leaf, of its first triangle
  int32_t count[bvhWidth]; ///< of a leaf's triangles; 0: it is no leaf
};

/// A triangle of the tree.
struct BvhTriangle {
  float corner[3][3]; ///< the positions of its vertices
  int32_t index;      ///< its place among the triangles
};

} // namespace piko::scene

#include <piko/macros_end.h>

#endif // PIKO_SCENE_H
