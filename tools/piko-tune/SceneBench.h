//===- SceneBench.h - A scene that settings render --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKOTUNE_SCENEBENCH_H
#define PIKO_TOOLS_PIKOTUNE_SCENEBENCH_H

#include "Frame.h"
#include "Space.h"

#include "Piko/Replay/Measure.h"
#include "Piko/Scene/Image.h"

#include <map>
#include <memory>

namespace piko::tune {

class SceneBench : public Bench {
public:
  /// Reads the scene, and the reference image if there is one.
  static render::Result<std::unique_ptr<SceneBench>>
  create(const TuneOptions &options, const Space &space);

  render::Result<uint64_t> prepare(const Setting &setting) override;
  render::Result<double> visit(const Setting &setting) override;
  /// Where there is no reference image yet, the setting's image becomes it.
  render::Result<double> measureError(const Setting &setting) override;
  void release(const Setting &setting) override;
  /// Which versions of loops are faster in a setting, as measured in the frames
  /// that it has run and, if that is not enough, a few more.
  render::Result<std::string> findMappings(const Setting &setting);
  const render::SceneInput &getScene() const { return scene; }

private:
  /// A pipeline with its scene; made when it first runs.
  struct Instance {
    std::optional<render::SceneInput> own; ///< a capture, which runs change
    render::PipelineOwner owner;
    std::string image;
  };
  struct Entry {
    std::unique_ptr<LoadedProgram> program;
    std::unique_ptr<Instance> instance;
  };

  SceneBench(const TuneOptions &options, const Space &space)
      : options(options), space(space) {}
  render::Options getOptions(const Setting &setting) const;
  render::Result<Instance *> getInstance(const Setting &setting);
  /// Of all numbers, where there is no image.
  render::Result<double> measureNumbers(Instance &instance);

  const TuneOptions &options;
  const Space &space;
  render::SceneInput scene;
  std::optional<render::Image> reference;
  std::optional<replay::Outcome> referenceOutcome;
  std::map<Setting, Entry> entries;
};

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_SCENEBENCH_H
