// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-compare: runs pipelines on the reference executor and on one or more targets,
// on the same made-up input, and compares all state bit for bit.
//
// --help says what the options are, Run.h what the input is. With --cases
// each line of that file is a case, with the options --pipe to --budget; a
// line of output says which case begins, and one how it ends. Exit status 0 if
// all is equal.
//
// --targets names what a case runs on: `cpu`, which is this machine's processor,
// others by the names that LLVM has for them, `gpu-on-cpu` and `cuda`. The file is
// read once, and the reference executor runs once. What differs is said of each
// target by name, what several do alike once; a target that cannot compile or run a
// case has an error, and the others go on. `aarch64` is code for another machine,
// which --runner begins.
//
// Of a pipeline with a stage that is not strict, all runs on a target must give the
// same bits, and how far these are from the reference executor's is reported field
// by field. --tolerance X says how far they may be: numbers relatively by X,
// integers not at all.

#include "Options.h"
#include "Programs.h"
#include "Remote.h"
#include "Report.h"
#include "Run.h"

#include "Piko/CommandLine/Messages.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Replay/Measure.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <unistd.h>

using piko::replay::Measure;
using piko::replay::Outcome;

namespace {

/// A case on one target.
class TargetRun {
public:
  TargetRun(const Options &options, const Target &target, Report &report)
      : options(options), target(target), report(report) {
    if (&target == &options.targets.front())
      return;
    threads = {options.threads.back()};
    runs = 1;
  }

  /// True if all is equal. Throws if it cannot be run. `reference` has the input.
  bool compare(const Case &input, Outcome expected, Programs &programs,
               Run &reference);

  bool isStrict = true;
  /// The messages of runs that stopped, empty for those that did not.
  std::set<std::string> errors;

private:
  /// What a run with so many threads leaves.
  using Runs = std::function<Outcome(int)>;
  bool acceptMeasured(Outcome &expected, const Runs &compiled);
  bool compareRuns(Outcome expected, const Runs &compiled);
  bool compareRemotely(const Case &input, const Outcome &expected,
                       Programs &programs, Run &reference);
  void reportOwners(const Run &compiled);
  void say(const std::string &line) { report.add(target.name, line); }

  const Options &options;
  const Target &target;
  Report &report;
  std::vector<int> threads = options.threads;
  int runs = options.runs;
};

/// What a run should give that need not be strict: what it gives itself, if that
/// is near enough to what the reference executor does. True if it is.
bool TargetRun::acceptMeasured(Outcome &expected, const Runs &compiled) {
  Outcome actual = compiled(threads[0]);
  if (!expected.error.empty() || !actual.error.empty())
    return true; // to be compared as they are
  Measure measure = measureOutcomes(expected, actual);
  for (const std::string &line : measure.lines)
    say(line);
  expected = std::move(actual);
  if (!options.tolerance || measure.isWithin(*options.tolerance))
    return true;
  char line[64];
  std::snprintf(line, sizeof line, "expected differences of at most %g",
                *options.tolerance);
  say(line);
  return false;
}

void TargetRun::reportOwners(const Run &compiled) {
  for (const auto &[bin, owners] : compiled.owners()) {
    std::string line = bin.first + ", bin " + std::to_string(bin.second) + ":";
    for (int32_t thread : owners)
      line += " " + std::to_string(thread);
    say(line);
  }
}

bool TargetRun::compareRuns(Outcome expected, const Runs &compiled) {
  bool equal = isStrict || acceptMeasured(expected, compiled);
  for (int count : threads)
    for (int run = 0; run < runs; ++run) {
      Outcome actual = compiled(count);
      errors.insert(actual.error);
      std::vector<std::string> differences = compareOutcomes(expected, actual);
      equal &= differences.empty();
      for (const std::string &difference : differences)
        say(std::to_string(count) + " threads, run " + std::to_string(run) +
            ": " + difference);
    }
  return equal;
}

/// All runs begin where the reference executor's did.
bool TargetRun::compareRemotely(const Case &input, const Outcome &expected,
                                Programs &programs, Run &reference) {
  CompiledPipeline compiled = programs.compileObject(input.pipe, target);
  isStrict = compiled.isStrict;
  WorkFolder folder;
  reference.divide(input.strip, input.budget);
  reference.capture(folder / "capture");
  reference.divide(0, 0);
  std::vector<Outcome> outcomes = runRemotely(
      options.runner, compiled.code, input.pipe, folder / "capture", threads);
  runs = 1;
  return compareRuns(expected, [&](int count) {
    auto place = std::find(threads.begin(), threads.end(), count);
    return outcomes[size_t(place - threads.begin())];
  });
}

bool TargetRun::compare(const Case &input, Outcome expected, Programs &programs,
                        Run &reference) {
  if (!target.arch.empty())
    return compareRemotely(input, expected, programs, reference);
  Program program = programs.compile(input.pipe, target);
  isStrict = program.isStrict;
  Run compiled(program, input);
  compiled.divide(input.strip, input.budget);
  if (options.owners)
    compiled.recordOwners();
  bool equal = compareRuns(std::move(expected), std::ref(compiled));
  reportOwners(compiled);
  return equal;
}

/// The last line of a case.
void printVerdict(const Outcome &expected, bool isStrict,
                  const std::vector<std::string> &equal,
                  const std::vector<std::string> &different) {
  auto name = [](const std::vector<std::string> &targets) {
    std::string names = joinNames(targets);
    return names.empty() ? "" : " on " + names;
  };
  if (!expected.error.empty())
    std::printf("the reference stops: %s\n", expected.error.c_str());
  else if (!equal.empty())
    std::printf("equal%s%s%s\n", expected.isBlank() ? ", but blank" : "",
                isStrict ? "" : " in all runs", name(equal).c_str());
  if (std::string names = name(different); !names.empty())
    std::printf("differs%s\n", names.c_str());
}

/// Whether all runs on all targets stopped with one message. The reference executor
/// may say more, or have a longer breath.
bool stopAlike(const std::set<std::string> &errors) {
  if (errors.size() == 1 && !errors.begin()->empty())
    return true;
  std::printf("expected all targets to stop with the same message\n");
  return false;
}

/// Whether a target runs a case. With --spread one does, in turn, from one that the
/// file's name says; what is to stop alike runs on the first one as well.
bool runs(const Options &options, size_t target, size_t place) {
  if (!options.spread)
    return true;
  std::string name = std::filesystem::path(options.file).stem().string();
  size_t first = std::accumulate(name.begin(), name.end(), size_t(0));
  size_t fixed = options.stops ? 1 : 0;
  return target < fixed ||
         (first + place) % (options.targets.size() - fixed) == target - fixed;
}

/// Runs one case on its targets; true if all is equal. Throws if it cannot be run.
bool compare(const Options &options, const Case &input, Programs &programs,
             size_t place = 0) {
  std::optional<piko::Progress> progress("comparing " + input.pipe);
  Run reference(programs.reference(input.pipe), input);
  Outcome expected = reference(1);
  if (expected.isBlank() && (options.cases.empty() || hasOwnCases(options)))
    throw std::runtime_error("the reference executor wrote nothing");
  Report report;
  bool isStrict = true;
  std::set<std::string> errors;
  std::vector<std::string> equal, different;
  for (const Target &target : options.targets) {
    if (!runs(options, size_t(&target - options.targets.data()), place))
      continue;
    TargetRun run(options, target, report);
    bool isEqual = false;
    try {
      isEqual = run.compare(input, expected, programs, reference);
    } catch (const std::exception &error) {
      if (target.name.empty())
        throw;
      report.add(target.name, "error: " + std::string(error.what()));
      errors.insert("");
    }
    isStrict &= run.isStrict;
    errors.merge(run.errors);
    (isEqual ? equal : different).push_back(target.name);
    progress->update(double(&target + 1 - options.targets.data()) /
                     double(options.targets.size()));
  }
  progress.reset();
  report.print();
  printVerdict(expected, isStrict, equal, different);
  if (options.stops)
    return stopAlike(errors);
  return different.empty();
}

bool compareAll(const Options &options) {
  std::optional<piko::Progress> progress("reading " + options.file);
  Programs programs(options);
  progress.reset();
  auto choosePipe = [&](Case &input) {
    std::vector<std::string> names = programs.names();
    if (!input.pipe.empty())
      return;
    if (names.size() != 1)
      throw std::runtime_error(
          "--pipe: expected one of the file's pipelines: " + joinNames(names));
    input.pipe = names[0];
  };
  if (options.cases.empty()) {
    Case one = options.one;
    choosePipe(one);
    return compare(options, one, programs);
  }
  bool equal = true;
  std::vector<Case> cases = readCases(options);
  for (size_t i = 0; i < cases.size(); ++i) {
    Case &input = cases[i];
    choosePipe(input);
    std::printf("%s:\n", input.pipe.c_str());
    std::fflush(stdout);
    alarm(options.timeout);
    try {
      equal &= compare(options, input, programs, i);
    } catch (const std::exception &error) {
      std::printf("error: %s\n", error.what());
      equal = false;
    }
  }
  return equal;
}

} // namespace

/// Says what went wrong, where that has no place of its own. A difference has the status
/// 1.
static int fail(const std::string &message) {
  std::string lines = piko::addToolName("piko-compare", message);
  std::fputs(lines.c_str(), stderr);
  return 2;
}

/// The exit status, once all is written.
static int finish(int status) {
  auto ok = piko::support::finishOutput();
  return ok ? status : fail("error: " + ok.error().message);
}

/// Returns the exit status.
static int run(int argc, char **argv) {
  try {
    Options options = parseOptions(argc, argv);
    if (!options.help.empty()) {
      std::fputs(options.help.c_str(), stdout);
      return finish(0);
    }
    return finish(compareAll(options) ? 0 : 1);
  } catch (const NotCompiled &error) {
    return fail(error.diagnostics + "error: " + error.reason);
  } catch (const std::bad_alloc &) {
    piko::support::endOutOfMemory();
  } catch (const std::exception &error) {
    return fail(std::string("error: ") + error.what());
  }
}

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-compare");
  // More threads than cores: to wait must not cost time.
  setenv("OMP_WAIT_POLICY", "passive", /*overwrite=*/0);
  return piko::runMainOnDeepStack([&] { return run(argc, argv); });
}
