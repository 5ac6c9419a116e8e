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
  auto found = metrics.find(name);
  if (found == metrics.end())
    throw CommandLine::wrong("--metric",
                             "expected max, mean, rms, p99 or flip, but got '" +
                                 name + "'");
  options.metricName = name;
  options.metric = found->second;
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

void setClock(const std::string &clock, TuneOptions &options) {
  options.countsCPU = clock == "cpu";
  if (clock != "cpu" && clock != "wall")
    throw CommandLine::wrong("--clock",
                             "expected wall or cpu, but got '" + clock + "'");
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
  add("--metric", "METRIC", setMetric,
      "the error, as piko-diff measures it: max, mean, rms, p99 or flip (max)");
  line.addText("--reference", "IMAGE", options.reference,
               "what images are compared with (what the text gives)");
  add("--space", "GROUP,...", setSpace,
      "what may be changed, of tunables, schedules, lanes, numbers, passes, "
      "strips, and single passes of synthesis by name (all groups but strips)");
  line.addNumber("--budget", "RUNS", options.budget,
                 "frames to run at most (500)", 1, 1'000'000'000);
  add("--clock", "CLOCK", setClock,
      "what counts: wall, the time that a frame takes, or cpu, that of "
      "processors, for machines that do something else, too, with --threads 1 "
      "(wall)");
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
      "changed in the text.");
  TuneOptions options;
  addOptions(line, options);
  line.beginGroup("How the scene is seen and run, as for piko-render");
  render::addSceneOptions(line, options.render);
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  std::string problem = render::checkOptions(line, options.render);
  if (options.help.empty() && !problem.empty())
    return Error{problem};
  return options;
}
