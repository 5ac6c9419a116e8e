//===- Frame.h - A scene bound to a pipeline --------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko-render and piko-tune do before and after a run.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKORENDER_FRAME_H
#define PIKO_TOOLS_PIKORENDER_FRAME_H

#include "Options.h"

#include "Piko/Scene/Binding.h"

#include <pikort/pikort.h>

#include <memory>
#include <utility>

namespace piko::render {

/// A pipeline of the runtime, destroyed at the end.
struct PipelineOwner {
  PipelineOwner() = default;
  PipelineOwner(PipelineOwner &&other) noexcept
      : pipeline(std::exchange(other.pipeline, nullptr)) {}
  PipelineOwner &operator=(PipelineOwner &&other) noexcept {
    std::swap(pipeline, other.pipeline);
    return *this;
  }
  ~PipelineOwner() { pikort_destroy(pipeline); }

  pikort_pipeline *pipeline = nullptr;
};

/// What went wrong with a pipeline last.
Error errorOf(pikort_pipeline *pipeline);

/// Reads the scene and sets camera, lights and values as options say. `tool` is
/// whose warnings it prints.
Result<SceneInput> loadScene(const Options &options,
                             const std::string &tool = "piko-render");

/// Binds a scene, which must outlive the runs, and says how sources are
/// divided, which a capture has of its host: the name of the image.
Result<std::string> bindInput(const Options &options, pikort_pipeline *pipeline,
                              SceneInput &scene);

/// Makes a pipeline of a program and binds a scene, which must outlive it: the
/// name of its image.
Result<std::string> createPipeline(const Options &options,
                                   const pikort_program &program,
                                   SceneInput &scene, PipelineOwner &owner);

/// The image of that name, of whichever kind of colours it is.
Result<std::vector<scene::Color>> readImage(pikort_pipeline *pipeline,
                                            const std::string &name);

/// A compiled program, and a pipeline of it that is bound to a scene.
class Frame {
public:
  Frame() = default;
  Frame(Frame &&) = default;
  /// Pipelines go before their programs, so neither is destroyed here.
  Frame &operator=(Frame &&other) noexcept {
    std::swap(program, other.program);
    std::swap(owner, other.owner);
    std::swap(output, other.output);
    return *this;
  }

  /// Compiles what the options name, and says on stderr what the compiler has
  /// to say, of what was compiled before its errors alone; an error without a
  /// message if that is all.
  static Result<Frame> load(const Options &options, bool wasCompiled = false);
  /// Binds a scene, which must outlive the frame.
  Result<Done> bind(const Options &options, SceneInput &scene);
  /// Runs once.
  Result<Done> run();

  pikort_pipeline *pipeline() const { return owner.pipeline; }
  /// The name of the image that the pipeline makes.
  const std::string &image() const { return output; }
  double compileMilliseconds() const { return program->compileMilliseconds(); }
  bool isFromCache() const { return program->isFromCache(); }

private:
  std::unique_ptr<LoadedProgram> program; // goes last
  PipelineOwner owner;
  std::string output;
};

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_FRAME_H
