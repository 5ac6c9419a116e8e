//===- Space.cpp - What a text leaves open --------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Space.h"

#include "Piko/Driver/Compiler.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Diagnostics.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/Support/raw_ostream.h"
#include "llvm/TargetParser/Host.h"

using namespace piko;
using namespace piko::tune;

/// Passes that may cost more than they gain: those that join stages, keep
/// things for later, or fetch them early.
static const char *const passes[] = {
    "fuse-stages", "fuse-kernels", "test-early",    "defer-shading",
    "form-tiles",  "prefetch",     "slp-vectorizer"};

TunedSetting Space::describe(const Setting &setting) const {
  TunedSetting result{.pipeline = dimensions[0].values[setting[0]]};
  for (size_t d = 1; d < setting.size(); ++d) {
    if (setting[d] == 0)
      continue;
    const Axis &axis = axes[d];
    const std::string &value = dimensions[d].values[setting[d]];
    switch (axis.kind) {
    case Axis::Pipeline:
      break;
    case Axis::Tunable:
      result.tunables.emplace_back(axis.key, value);
      break;
    case Axis::Directive:
      result.directives.push_back(axis.key + "=" + value);
      break;
    case Axis::Pass:
      result.without.push_back(axis.key);
      break;
    case Axis::Strip:
      result.stripSize = std::stoll(value);
      break;
    }
  }
  return result;
}

std::string Space::name(const Setting &setting) const {
  std::string text = dimensions[0].values[setting[0]];
  for (size_t d = 1; d < setting.size(); ++d)
    if (setting[d] != 0)
      text += axes[d].kind == Axis::Pass ? " without " + axes[d].key
                                         : " " + dimensions[d].name + "=" +
                                               dimensions[d].values[setting[d]];
  return text;
}

namespace {

/// Adds dimensions, group by group.
struct SpaceReader {
  void add(Axis::Kind kind, std::string key, std::vector<std::string> values,
           std::optional<int> pipeline = std::nullopt) {
    space.dimensions.push_back({key, std::move(values), pipeline});
    space.axes.push_back({kind, std::move(key)});
  }
  bool has(const char *group) const { return options.space.contains(group); }
  void addStage(const StageDescription &stage, int pipeline);

  const TuneOptions &options;
  Space space = {};
};

} // namespace

/// Whether a schedule says where bins run, and nothing else.
static bool saysOnlyWhere(const ScheduleDescription &schedule) {
  return schedule.says("kind") &&
         llvm::all_of(schedule.ofSchedule, [](mlir::NamedAttribute said) {
           return said.getName() == "kind" || said.getName() == "tileSplit";
         });
}

/// What cannot be set is not tried, as far as the text shows it.
void SpaceReader::addStage(const StageDescription &stage, int pipeline) {
  if (has("schedules") && !stage.schedule.isDynamic) {
    std::vector<std::string> values = {"text", "load_balance", "direct_map"};
    if (saysOnlyWhere(stage.schedule))
      values.push_back("none");
    add(Axis::Directive, stage.name + ":schedule", values, pipeline);
  }
  if (has("lanes")) {
    std::vector<std::string> values = {"text", "iterations", "one"};
    if (!stage.takesList)
      values.insert(values.end(), {"items", "collapsed"});
    add(Axis::Directive, stage.name + ":lanes", values, pipeline);
  }
  if (has("numbers") && options.error > 0)
    add(Axis::Directive, stage.name + ":precision",
        {"text", "contracted", "relaxed"}, pipeline);
}

/// The names of the pipelines to choose from; empty after diagnostics.
static std::vector<std::string> findPipes(const TuneOptions &options,
                                          const CompileOptions &source,
                                          mlir::MLIRContext &context) {
  if (!options.pipes.empty())
    return options.pipes;
  auto names = readPipelineNames(source, context);
  if (llvm::failed(names))
    return {};
  if (names->size() == 1)
    return *names;
  std::string list;
  for (const std::string &name : *names)
    list += (list.empty() ? "" : ", ") + name;
  mlir::emitError(mlir::FileLineColLoc::get(&context, source.file, 1, 1))
      << "expected --pipe with some of the file's pipelines: " << list;
  return {};
}

static std::optional<Space> readSpaceHere(const TuneOptions &options,
                                          std::string &diagnostics) {
  PikoContext context;
  llvm::raw_string_ostream stream(diagnostics);
  DiagnosticPrinter printer(context, stream, /*remarks=*/false);
  CompileOptions source{.file = options.render.pipeline,
                        .includeDirs = options.render.load.includeDirs,
                        .defines = options.render.load.defines,
                        .cache = options.render.load.cache};
  std::vector<std::string> pipes = findPipes(options, source, context);
  if (pipes.empty())
    return std::nullopt;
  auto tunables = readTunables(source, context);
  if (llvm::failed(tunables))
    return std::nullopt;
  SpaceReader reader{options};
  reader.add(Axis::Pipeline, "pipe", pipes);
  if (reader.has("tunables"))
    for (const TunableDescription &tunable : *tunables)
      reader.add(Axis::Tunable, tunable.name, tunable.values);
  FrontendOptions frontend = getFrontendOptions(source);
  for (size_t i = 0; i < pipes.size(); ++i) {
    frontend.pipeName = pipes[i];
    auto pipeline = describePipe(source.file, frontend, context);
    if (llvm::failed(pipeline))
      return std::nullopt;
    for (const StageDescription &stage : pipeline->stages)
      reader.addStage(stage, int(i));
  }
  for (const std::string &pass : SynthesisOptions::getOptional()) {
    bool isAsked = reader.has(pass.c_str()) ||
                   (reader.has("passes") && llvm::is_contained(passes, pass));
    if (isAsked && options.render.load.synthesis.has(pass))
      reader.add(Axis::Pass, pass, {"yes", "no"});
  }
  if (reader.has("strips") && options.render.stripSize == 0)
    reader.add(Axis::Strip, "strip", {"0", "4096", "32768"});
  return std::move(reader.space);
}

std::optional<Space> tune::readSpace(const TuneOptions &options,
                                     std::string &diagnostics) {
  std::optional<Space> space;
  auto failed = runContained(
      [&]() -> void { space = readSpaceHere(options, diagnostics); });
  if (!failed)
    return space;
  diagnostics += "error: " + *failed + "\n";
  return std::nullopt;
}

std::string tune::getProcessorName() {
  return llvm::sys::getHostCPUName().str();
}
