//===- EglContext.h - A context of OpenGL without a window ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// By EGL, whose library is loaded here: a machine that has none is told of it.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_BENCHMARKS_OPENGL_EGLCONTEXT_H
#define PIKO_BENCHMARKS_OPENGL_EGLCONTEXT_H

#include "GL.h"

#include <memory>
#include <string>

namespace piko::peer {

struct ContextOptions {
  std::string library = "libEGL.so.1";
  bool software = false; ///< by a renderer that needs no card, and by no other
  int cudaDevice = 0;    ///< whose card is wanted most
};

/// OpenGL 4.3 or later, core profile, without a surface, current in this
/// thread, until it is destroyed.
class EglContext {
public:
  /// In this order of what EGL has: the CUDA device's card, another one of
  /// NVIDIA's, another one, what Mesa's surfaceless platform takes. The error
  /// says of each why it is none.
  static Result<EglContext> create(const ContextOptions &options);

  const GL &gl() const;
  /// Which one it is, as EGL counts.
  const std::string &device() const;

private:
  struct State;
  explicit EglContext(std::shared_ptr<State> state);

  std::shared_ptr<State> state;
};

} // namespace piko::peer

#endif // PIKO_BENCHMARKS_OPENGL_EGLCONTEXT_H
