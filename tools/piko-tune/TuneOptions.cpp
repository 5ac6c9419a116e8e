//===- TuneOptions.cpp - The command line of piko-tune --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "TuneOptions.h"

#include <cmath>
#include <map>

using namespace piko;
using namespace piko::tune;
using render::Error;
using render::Result;

namespace {

void setError(const std::string &text, TuneOptions &options) {
  options.errorText = text;
  size_t slash = text.find('/');
  try {
    options.error =
        CommandLine::readNumber<double>("--error", text.substr(0, slash));
    if (slash != std::string::npos)
      options.error /=
          CommandLine::readNumber<double>("--error", text.substr(slash + 1));
  } catch (const CLI::ValidationError &) {
    options.error = -1;
  }
  if (!(options.error >= 0) || !std::isfinite(options.error))
    throw CommandLine::wrong(
        "--error",
        "expected a number of at least 0, or A/B, but got '" + text + "'");
}

void setMetric(const std::string &name, TuneOptions &options) {
  static const std::map<std::string, Metric> metrics = {{"max", Metric::Max},
                                                        {"mean", Metric::Mean},
                                                        {"rms", Metric::RMS},
                                                        {"p99", Metric::P99},
                                                        {"flip", Metric::FLIP}};
  options.metricName = name;
  options.metric = metrics.at(name);
}

void setSpace(const std::string &names, TuneOptions &options) {
  static const std::set<std::string> groups = {
      "tunables", "schedules", "lanes", "numbers", "passes", "strips"};
  options.space.clear();
  for (const std::string &group : splitNames("--space", names)) {
    if (!groups.contains(group) && !parseSynthesisOptions(group))
      throw CommandLine::wrong(
          "--space", "expected tunables, schedules, lanes, numbers, passes, "
                     "strips or the name of a pass, but got '" +
                         group + "'");
    options.space.insert(group);
  }
}

void addOptions(CommandLine &line, TuneOptions &options) {
  auto add = [&](const std::string &name, const std::string &value,
                 void (*set)(const std::string &, TuneOptions &),
                 const std::string &description) {
    line.addText(
        name, value, [=, &options](const auto &text) { set(text, options); },
        description);
  };
  add(
      "--pipe", "NAME,...",
      [](const std::string &names, TuneOptions &options) {
        options.pipes = splitNames("--pipe", names);
      },
      "pipelines to choose from, first the one to compare with (the only one "
      "of the file)");
  add("--error", "E", setError,
      "the largest error that is allowed, 0 or more, or A/B (1/255); 0 leaves "
      "out precisions");
  line.addChoice(
      "--metric", "METRIC",
      {{"max", "the largest difference"},
       {"mean", "the mean one"},
       {"rms", "the root of the mean square"},
       {"p99", "the 99th percentile"},
       {"flip", "what an observer notices"}},
      [&](const std::string &name) { setMetric(name, options); },
      "the error, as piko-diff measures it (max):");
  line.addText("--reference", "IMAGE", options.reference,
               "what images are compared with (what the text gives)");
  add("--space", "GROUP,...", setSpace,
      "what may be changed, of tunables, schedules, lanes, numbers, passes, "
      "strips, and single passes of synthesis by name (all groups but strips)");
  line.addNumber("--budget", "RUNS", options.budget,
                 "frames to run at most (500)", 1, 1'000'000'000);
  line.addChoice(
      "--clock", "CLOCK",
      {{"wall", "the time that a frame takes"},
       {"cpu", "that of processors, for machines that do something else, too, "
               "with --threads 1"}},
      [&](const std::string &clock) { options.countsCPU = clock == "cpu"; },
      "what counts (wall):");
  line.addText("--out", "FILE", options.out,
               "write the setting for pikoc --tuned and piko-render --tuned");
  line.addText("--chart", "FILE.svg", options.chart, "draw error against time");
  line.addText("--csv", "FILE", options.csv,
               "write what was measured, a line for each setting");
  line.add_flag("--json", options.json, "print one line of JSON");
  line.add_flag("--exhaustive", options.exhaustive,
                "then run all settings, and say how much slower the chosen one "
                "is than the best");
}

} // namespace

Result<TuneOptions>
tune::parseTuneOptions(const std::vector<std::string> &words) {
  CommandLine line(
      "piko-tune [options] FILE.piko.cpp SCENE",
      "Looks for the setting of a pipeline that renders a scene fastest, of "
      "all whose error is small enough: values of its tunables, and schedules, "
      "lanes, precisions and passes that the text leaves open. Nothing is "
      "changed in the text.",
      "piko-tune raster.piko.cpp --pipe Fused bunny.obj --out fast.json");
  TuneOptions options;
  addOptions(line, options);
  line.beginGroup("How the scene is seen and run, as for piko-render");
  render::addSceneOptions(line, options.render);
  line.setBrief("--pipe",
                "which pipelines may be chosen; the first is the text's");
  line.setBrief("--error", "the largest error that is allowed (1/255)");
  line.setBrief("--metric",
                "how it is measured: max, mean, rms, p99, flip (max)");
  line.setBrief("--space", "what may be changed: tunables, schedules, ...");
  line.setBrief("--budget", "frames to run at most (500)");
  line.setBrief("--out", "write the setting, for --tuned");
  line.setBrief("--chart", "draw error against time");
  line.setBrief("--json", "print one line of JSON");
  line.setBrief("--threads", "threads, 0 for all (0)");
  line.setBrief("--width", "pixels of a row (1024)");
  line.setBrief("--height", "rows (768)");
  line.setBrief("-I", "for the pipeline's preprocessor");
  line.setBrief("-D", "likewise");
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  std::string problem = render::checkOptions(line, options.render);
  if (options.help.empty() && !problem.empty())
    return Error{problem};
  return options;
}
