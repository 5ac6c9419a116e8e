//===- Drawing.h - A scene as OpenGL draws it -------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The picture that examples/raster and examples/visibility make: indexed
// triangles in the mesh's order, a float of depth for each pixel, and of
// colours what piko/scene.h defines, in 8 bits for each channel.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_BENCHMARKS_OPENGL_DRAWING_H
#define PIKO_BENCHMARKS_OPENGL_DRAWING_H

#include "GL.h"

#include "Piko/Scene/Binding.h"
#include "Piko/Scene/Image.h"

namespace piko::peer {

enum class Technique {
  Forward, ///< shades what passes the test of depth when it is drawn
  Prepass, ///< draws all depths first, then shades what is seen
};

/// In a context that outlives it, which has its objects until it goes.
class Drawing {
public:
  /// Copies the mesh and the lights to the device. The errors are the driver's:
  /// the image or the scene is too large for it, or it refuses the shaders.
  static Result<Drawing> create(const GL &gl, const render::SceneInput &scene,
                                Technique technique);

  /// Draws a frame, from clearing the image on, and returns before it is done.
  void draw() const;

  /// The last frame.
  Result<render::Image> read() const;

private:
  Drawing(const GL &gl, const render::SceneInput &scene, Technique technique)
      : gl(gl), size(scene.size), technique(technique) {}

  Result<Done> makeImage();
  Result<Done> copyMesh(const render::Mesh &mesh);
  Result<Done> makePrograms(const render::SceneInput &scene);
  std::string declareLights(const render::SceneInput &scene) const;

  const GL &gl;
  glm::ivec2 size;
  Technique technique;
  GLsizei indices = 0;
  GLuint depthProgram = 0, shadeProgram = 0;
};

} // namespace piko::peer

#endif // PIKO_BENCHMARKS_OPENGL_DRAWING_H
