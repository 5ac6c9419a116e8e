//===- piko-tune.cpp - The fastest setting within an error ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reads what a text leaves open (Space.h), looks for the fastest setting
// (Search.h) by rendering a scene (SceneBench.h), and writes it down (Report.h,
// Chart.h).
//
//===----------------------------------------------------------------------===//
#include "Chart.h"
#include "Exhaustive.h"
#include "Report.h"
#include "SceneBench.h"

#include "Piko/CommandLine/Messages.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <csignal>
#include <cstdio>
#include <optional>

using namespace piko;
using namespace piko::tune;
using support::Done;
using support::Error;
using support::Result;

namespace {

/// An error if the files cannot be written: before a search, which takes long.
Result<Done> checkFiles(const TuneOptions &options) {
  for (const std::string &path : {options.out, options.chart, options.csv})
    if (!path.empty())
      if (auto ok = support::checkWritable(path); !ok)
        return ok;
  return Done{};
}

/// The files, and the standard output; all of them or, as far as that can be
/// known before, none.
Result<Done> write(const TuneResult &result) {
  const TuneOptions &options = result.options;
  support::OutputFiles files;
  for (const auto &[path, text] : {std::pair(options.out, writeSetting(result)),
                                   std::pair(options.chart, drawChart(result)),
                                   std::pair(options.csv, writeCSV(result))})
    if (!path.empty())
      if (auto ok = files.add(path, text); !ok)
        return ok;
  std::string text = options.json ? writeJson(result) : summarize(result);
  std::fputs(text.c_str(), stdout);
  if (auto ok = support::finishOutput(); !ok)
    return ok;
  return files.keep();
}

Result<Space> loadSpace(const TuneOptions &options) {
  std::string diagnostics;
  std::optional<Progress> progress("reading " + options.render.pipeline);
  auto space = readSpace(options, diagnostics);
  progress.reset();
  std::fputs(addToolName("piko-tune", diagnostics).c_str(), stderr);
  if (!space)
    return Error{}; // already said
  return std::move(*space);
}

/// Colours are floats: one step of 255 may be a little more than 1/255.
double getLimit(const TuneOptions &options) { return options.error * 1.0001; }

Result<Outcome> runSearch(Search &search, const TuneOptions &options) {
  Progress progress("tuning for " + options.render.scene);
  search.log = [&](const std::string &line) {
    progress.say("piko-tune: " + line);
  };
  search.advance = [&](double part) { progress.update(part); };
  auto outcome = search.run();
  search.log = [](const std::string &) {};
  search.advance = [](double) {};
  return outcome;
}

/// Everything after the command line.
Result<Done> tuneScene(const TuneOptions &options) {
  if (auto ok = checkFiles(options); !ok)
    return ok;
  auto space = loadSpace(options);
  if (!space)
    return space.error();
  auto bench = SceneBench::create(options, *space);
  if (!bench)
    return bench.error();
  Search search(space->dimensions, **bench, getLimit(options), options.budget);
  auto outcome = runSearch(search, options);
  if (!outcome)
    return outcome.error();
  const render::SceneInput &scene = (*bench)->getScene();
  TuneResult result{options,
                    *space,
                    scene.size,
                    scene.capture.has_value(),
                    search.getTrials(),
                    *outcome};
  if (options.exhaustive) {
    auto survey = surveyAll(space->dimensions, **bench, getLimit(options),
                            outcome->chosen->setting);
    if (!survey)
      return survey.error();
    result.survey = *survey;
  }
  auto mappings = (*bench)->findMappings(outcome->chosen->setting);
  if (!mappings)
    return mappings.error();
  result.mappings = *mappings;
  return write(result);
}

int fail(const Error &error) {
  if (!error.message.empty())
    std::fprintf(stderr, "piko-tune: error: %s\n", error.message.c_str());
  return 1;
}

} // namespace

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-tune");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  auto options = parseTuneOptions({argv + 1, argv + argc});
  if (!options)
    return fail(options.error());
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto ok = support::finishOutput();
    return ok ? 0 : fail(ok.error());
  }
  if (auto ok = tuneScene(*options); !ok)
    return fail(ok.error());
  return 0;
}
