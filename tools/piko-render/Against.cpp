//===- Against.cpp - A run on several targets -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Against.h"

#include "Frame.h"

#include "Piko/CommandLine/Progress.h"
#include "Piko/Replay/Measure.h"

#include <algorithm>
#include <stdexcept>

using namespace piko;
using namespace piko::render;

/// The options for another target, or another processor.
static Options retarget(Options options, const std::string &target) {
  options.load.target =
      target == "reference" ? ExecutionTarget::Reference : ExecutionTarget::CPU;
  auto gpu = target == "reference" ? GPUTarget::None : parseGPUTarget(target);
  if (!gpu)
    options.load.cpu = target;
  options.load.gpu.target = gpu.value_or(GPUTarget::None);
  // Of loops of the code for the own target; others hold others in two
  // versions.
  options.mappings.clear();
  return options;
}

/// What one run leaves. It stops with an error as a target's run may: that is
/// an outcome, too.
static Result<replay::Outcome> runOnce(const Options &options,
                                       const std::string &label) {
  auto frame = Frame::load(options);
  if (!frame)
    return frame.error();
  auto scene = loadScene(options);
  if (!scene)
    return scene.error();
  if (auto ok = frame->bind(options, *scene); !ok)
    return ok.error();
  replay::Outcome outcome;
  {
    Progress progress(label);
    if (auto ok = frame->run(); !ok)
      outcome.error = ok.error().message;
  }
  if (!outcome.error.empty())
    return outcome;
  try {
    return replay::readOutcome(frame->pipeline());
  } catch (const std::runtime_error &error) {
    return Error{error.what()};
  }
}

static Agreement compare(const std::string &target, const replay::Outcome &own,
                         const replay::Outcome &other, double tolerance) {
  Agreement agreement{.target = target, .hasRun = true};
  agreement.differences = replay::compareOutcomes(other, own);
  agreement.isEqual = agreement.differences.empty();
  agreement.isWithin = agreement.isEqual;
  if (agreement.isEqual || !own.error.empty() || !other.error.empty())
    return agreement;
  replay::Measure measure = replay::measureOutcomes(other, own);
  agreement.relative = measure.relative;
  agreement.isWithin = measure.isWithin(tolerance);
  agreement.differences.insert(agreement.differences.end(),
                               measure.lines.begin(), measure.lines.end());
  return agreement;
}

Result<std::vector<Agreement>> render::runAgainst(const Options &options) {
  auto own = runOnce(options, "running once");
  if (!own)
    return own.error();
  std::vector<Agreement> agreements;
  for (const std::string &target : options.against) {
    auto other =
        runOnce(retarget(options, target), "running once on " + target);
    if (other)
      agreements.push_back(compare(target, *own, *other, options.tolerance));
    else
      agreements.push_back({.target = target, .error = other.error().message});
  }
  return agreements;
}

bool render::agree(const std::vector<Agreement> &agreements) {
  return std::all_of(agreements.begin(), agreements.end(),
                     [](const Agreement &agreement) {
                       return agreement.hasRun && agreement.isWithin;
                     });
}

std::string render::printAgreements(const std::vector<Agreement> &agreements) {
  std::string text;
  for (const Agreement &agreement : agreements) {
    text += "against " + agreement.target + ": ";
    if (!agreement.hasRun)
      text += "cannot run" +
              (agreement.error.empty() ? "" : ": " + agreement.error) + "\n";
    else if (agreement.isEqual)
      text += "equal\n";
    else
      text += agreement.isWithin ? "within the tolerance\n" : "differs\n";
    for (const std::string &difference : agreement.differences)
      text += "  " + difference + "\n";
  }
  return text;
}

Json render::reportAgreements(const std::vector<Agreement> &agreements) {
  Json report = Json::array();
  for (const Agreement &agreement : agreements) {
    Json &object = report.emplace_back();
    object["target"] = agreement.target;
    object["equal"] = agreement.isEqual ? 1 : 0;
    object["within"] = agreement.isWithin ? 1 : 0;
    object["relative"] = agreement.relative;
    std::string text = agreement.error;
    for (const std::string &difference : agreement.differences)
      text += (text.empty() ? "" : "; ") + difference;
    object["differences"] = text;
  }
  return report;
}
