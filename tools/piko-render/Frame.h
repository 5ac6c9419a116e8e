//===- Frame.h - A pipeline that is bound to a scene ------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_FRAME_H
#define PIKO_TOOLS_PIKORENDER_FRAME_H

#include "Options.h"

#include "Piko/Scene/Binding.h"

#include <memory>

namespace piko::render {

/// A compiled program, and a pipeline of it that is ready to run.
class Frame {
public:
  Frame() = default;
  Frame(Frame &&other) noexcept
      : program(std::move(other.program)),
        owned(std::exchange(other.owned, nullptr)),
        output(std::move(other.output)) {}
  Frame &operator=(Frame &&other) noexcept {
    std::swap(program, other.program);
    std::swap(owned, other.owned);
    std::swap(output, other.output);
    return *this;
  }
  ~Frame() { pikort_destroy(owned); }

  /// Compiles what the options name, and says on stderr what the compiler has
  /// to say; an error without a message if that is all.
  static Result<Frame> load(const Options &options);
  /// Binds a scene, which must outlive the frame.
  Result<Done> bind(const Options &options, SceneInput &scene);
  /// Runs once.
  Result<Done> run();

  pikort_pipeline *pipeline() const { return owned; }
  /// The name of the image that the pipeline makes.
  const std::string &image() const { return output; }
  double compileMilliseconds() const { return program->compileMilliseconds(); }

private:
  std::unique_ptr<LoadedProgram> program;
  pikort_pipeline *owned = nullptr;
  std::string output;
};

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_FRAME_H
