//===- TuneOptions.cpp - The command line of piko-tune --------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "TuneOptions.h"

#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <sstream>

using namespace piko;
using namespace piko::tune;
using render::Error;
using render::Result;

const char *const tune::usage =
    R"(usage: piko-tune [options] FILE.piko.cpp SCENE

Looks for the setting of a pipeline that renders a scene fastest, of all whose
error is small enough: values of its tunables, and schedules, lanes, precisions
and passes that the text leaves open. Nothing is changed in the text.

  --pipe NAME,...        pipelines to choose from, first the one to compare with
                         (the only one of the file)
  --error E              the largest error that is allowed, 0 or more, or A/B
                         (1/255); 0 leaves out precisions
  --metric max|mean|rms|p99|flip
                         the error, as piko-diff measures it (max)
  --reference IMAGE      what images are compared with (what the text gives)
  --space GROUP,...      what may be changed, of tunables, schedules, lanes,
                         numbers, passes, strips, and single passes of
                         synthesis by name (all groups but strips)
  --budget RUNS          frames to run at most (500)
  --clock wall|cpu       what counts: the time that a frame takes, or that of
                         processors, for machines that do something else, too,
                         with --threads 1 (wall)

  --out FILE             write the setting for pikoc --tuned and piko-render
                         --tuned
  --chart FILE.svg       draw error against time
  --csv FILE             write what was measured, a line for each setting
  --json                 print one line of JSON
  --exhaustive           then run all settings, and say how much slower the
                         chosen one is than the best
  --help                 print this

The scene and how it is seen and run, as for piko-render: --width, --height,
--lights, --eye, --at, --fovy, --cull, --ground, --set, --threads,
--memory-budget, --strip, --cpu, -I, -D, --without, --no-cache, --cache-dir.
)";

namespace {

/// Takes the words that are this tool's, and leaves the others to piko-render.
class Parser {
public:
  explicit Parser(const std::vector<std::string> &words) : words(words) {}

  Result<TuneOptions> parse() {
    while (next < words.size() && problem.empty())
      parseWord(words[next++]);
    if (!problem.empty())
      return Error{problem};
    if (options.help)
      return options;
    auto render = render::parseOptions(others);
    if (!render)
      return render.error();
    options.render = std::move(*render);
    return options;
  }

private:
  void parseWord(const std::string &word);
  void parseError();
  void parseMetric();
  void parseSpace();
  void parseBudget();
  void parseClock();

  std::string value(const std::string &name) {
    if (next < words.size())
      return words[next++];
    fail("option '" + name + "' lacks its value");
    return {};
  }
  void fail(const std::string &message) {
    if (problem.empty())
      problem = message;
  }

  const std::vector<std::string> &words;
  size_t next = 0;
  std::vector<std::string> others;
  TuneOptions options;
  std::string problem;
};

} // namespace

static std::vector<std::string> split(const std::string &text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');)
    parts.push_back(part);
  return parts;
}

/// How many values follow an option of piko-render; none if it is not for here.
static std::optional<int> countValues(const std::string &word) {
  static const std::map<std::string, int> counts = {{"--width", 1},
                                                    {"--height", 1},
                                                    {"--lights", 1},
                                                    {"--eye", 3},
                                                    {"--at", 3},
                                                    {"--fovy", 1},
                                                    {"--cull", 0},
                                                    {"--ground", 0},
                                                    {"--set", 1},
                                                    {"--threads", 1},
                                                    {"--memory-budget", 1},
                                                    {"--strip", 1},
                                                    {"--cpu", 1},
                                                    {"--without", 1},
                                                    {"--no-cache", 0},
                                                    {"--cache-dir", 1},
                                                    {"-I", 1},
                                                    {"-D", 1}};
  if (auto found = counts.find(word); found != counts.end())
    return found->second;
  if (word.empty() || word[0] != '-' || word.starts_with("-I") ||
      word.starts_with("-D"))
    return 0;
  return std::nullopt;
}

void Parser::parseWord(const std::string &word) {
  const std::map<std::string, std::function<void()>> actions = {
      {"--help", [&] { options.help = true; }},
      {"--pipe", [&] { options.pipes = split(value(word)); }},
      {"--error", [&] { parseError(); }},
      {"--metric", [&] { parseMetric(); }},
      {"--reference", [&] { options.reference = value(word); }},
      {"--space", [&] { parseSpace(); }},
      {"--budget", [&] { parseBudget(); }},
      {"--clock", [&] { parseClock(); }},
      {"--out", [&] { options.out = value(word); }},
      {"--chart", [&] { options.chart = value(word); }},
      {"--csv", [&] { options.csv = value(word); }},
      {"--json", [&] { options.json = true; }},
      {"--exhaustive", [&] { options.exhaustive = true; }},
  };
  if (auto action = actions.find(word); action != actions.end())
    return action->second();
  auto count = countValues(word);
  if (!count)
    return fail("unknown option '" + word + "'");
  others.push_back(word);
  for (int i = 0; i < *count && next < words.size(); ++i)
    others.push_back(words[next++]);
}

static std::optional<double> readNumber(const std::string &text) {
  double number = 0;
  auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size())
    return std::nullopt;
  return number;
}

void Parser::parseError() {
  std::string text = options.errorText = value("--error");
  size_t slash = text.find('/');
  auto above = readNumber(text.substr(0, slash));
  auto below = slash == std::string::npos ? std::optional(1.0)
                                          : readNumber(text.substr(slash + 1));
  if (above && below)
    options.error = *above / *below;
  if (!above || !below || !(options.error >= 0) ||
      !std::isfinite(options.error))
    fail("--error: expected a number of at least 0, or A/B, but got '" + text +
         "'");
}

void Parser::parseMetric() {
  static const std::map<std::string, Metric> metrics = {{"max", Metric::Max},
                                                        {"mean", Metric::Mean},
                                                        {"rms", Metric::RMS},
                                                        {"p99", Metric::P99},
                                                        {"flip", Metric::FLIP}};
  options.metricName = value("--metric");
  auto found = metrics.find(options.metricName);
  if (found == metrics.end())
    return fail("--metric: expected max, mean, rms, p99 or flip, but got '" +
                options.metricName + "'");
  options.metric = found->second;
}

void Parser::parseSpace() {
  static const std::set<std::string> groups = {
      "tunables", "schedules", "lanes", "numbers", "passes", "strips"};
  options.space.clear();
  for (const std::string &group : split(value("--space"))) {
    if (!groups.contains(group) && !parseSynthesisOptions(group))
      return fail("--space: expected tunables, schedules, lanes, numbers, "
                  "passes, strips or the name of a pass, but got '" +
                  group + "'");
    options.space.insert(group);
  }
}

void Parser::parseClock() {
  std::string clock = value("--clock");
  options.countsCPU = clock == "cpu";
  if (clock != "cpu" && clock != "wall")
    fail("--clock: expected wall or cpu, but got '" + clock + "'");
}

void Parser::parseBudget() {
  auto number = readNumber(value("--budget"));
  if (!number || *number < 1 || *number > 1e9 || *number != std::floor(*number))
    return fail("--budget: expected a number of runs");
  options.budget = int(*number);
}

Result<TuneOptions>
tune::parseTuneOptions(const std::vector<std::string> &words) {
  return Parser(words).parse();
}
