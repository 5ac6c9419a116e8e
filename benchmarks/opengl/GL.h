//===- GL.h - The part of OpenGL that the peer calls ------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// GL.def lists the functions; a context's library has them.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_BENCHMARKS_OPENGL_GL_H
#define PIKO_BENCHMARKS_OPENGL_GL_H

#include "Piko/Support/Result.h"

#include <GL/glcorearb.h>

#include <functional>
#include <string>

namespace piko::peer {

using support::Done;
using support::Error;
using support::Result;

/// The functions of a current context.
struct GL {
#define GL_FUNCTION(TYPE, NAME) TYPE NAME = nullptr;
#include "GL.def"
#undef GL_FUNCTION

  using Function = void (*)();
  using Find = std::function<Function(const char *)>;
  /// The error is that one of them is missing.
  static Result<GL> load(const Find &find);

  std::string text(GLenum name) const;
  int64_t number(GLenum name) const;

  /// The errors since the last call, if there are any; `what` says in what.
  Result<Done> check(const std::string &what) const;

  /// A program of two shaders, whose texts lack no `#version`. The error has
  /// the driver's log.
  Result<GLuint> link(const std::string &vertex,
                      const std::string &fragment) const;
};

} // namespace piko::peer

#endif // PIKO_BENCHMARKS_OPENGL_GL_H
