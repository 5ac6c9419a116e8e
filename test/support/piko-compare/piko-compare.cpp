// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-compare: runs pipelines on the CPU target and on the reference executor,
// on the same made-up input, and compares all state bit for bit.
//
//   piko-compare FILE [--reference FILE] [--pipe NAME] [--domain W H ..]
//                [--count N ..] [--seed S] [--wide] [--loop-limit N]
//                [--cases FILE] [--threads T ..] [--runs N]
//                [--timeout SECONDS] [--strip N] [--budget BYTES]
//                [--check[=nan:RECORD.FIELD,..]]
//                [--target gpu-on-cpu] [--gpu-threads N] [--gpu-seed N]
//                [--gpu-blocks N] [--gpu-chip NAME,..] [--tolerance X] [--cpu NAME]
//                [-O0] [--no-cache]
//
// Options.h says what the options mean, Run.h what the input is. With --cases
// each line of that file is a case, with the options --pipe to --loop-limit; a
// line of output says which case begins, and one how it ends. Exit status 0 if
// all is equal.
//
// Of a pipeline with a stage that is not strict, all runs must give the same
// bits, and how far these are from the reference executor's is reported field by
// field. --tolerance X says how far they may be: numbers relatively by X,
// integers not at all.

#include "Measure.h"
#include "Options.h"
#include "Programs.h"
#include "Run.h"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <unistd.h>

namespace {

void printMeasure(const Measure &measure) {
  for (const std::string &line : measure.lines)
    std::printf("%s\n", line.c_str());
}

/// What a run should give that need not be strict: what it gives itself, if that
/// is near enough to what the reference executor does. True if it is.
bool acceptMeasured(const Options &options, Result &expected, Run &compiled) {
  Result actual = compiled(options.threads[0]);
  if (!expected.error.empty() || !actual.error.empty())
    return true; // to be compared as they are
  Measure measure = measureResults(expected, actual);
  printMeasure(measure);
  expected = std::move(actual);
  return !options.tolerance || measure.isWithin(*options.tolerance);
}

/// Runs one case; true if all is equal. Throws if it cannot be run.
bool compare(const Options &options, const Case &input, Programs &programs) {
  Run reference(programs.reference(input.pipe), input);
  Result expected = reference(1);
  Program program = programs.compile(input.pipe);
  Run compiled(program, input);
  compiled.divide(options.strip, options.budget);
  if (options.owners)
    compiled.recordOwners();
  if (expected.isBlank() && options.cases.empty())
    throw std::runtime_error("the reference executor wrote nothing");
  bool equal = true;
  if (!program.isStrict && !acceptMeasured(options, expected, compiled)) {
    std::printf("expected differences of at most %g\n", *options.tolerance);
    equal = false;
  }
  for (int threads : options.threads)
    for (int run = 0; run < options.runs; ++run) {
      std::vector<std::string> differences =
          compareResults(expected, compiled(threads));
      equal &= differences.empty();
      for (const std::string &difference : differences)
        std::printf("%d threads, run %d: %s\n", threads, run,
                    difference.c_str());
    }
  for (const auto &[bin, threads] : compiled.owners()) {
    std::printf("%s, bin %lld:", bin.first.c_str(),
                static_cast<long long>(bin.second));
    for (int32_t thread : threads)
      std::printf(" %d", thread);
    std::printf("\n");
  }
  if (!expected.error.empty())
    std::printf("the reference stops: %s\n", expected.error.c_str());
  else if (equal)
    std::printf("%s%s\n", expected.isBlank() ? "equal, but blank" : "equal",
                program.isStrict ? "" : " in all runs");
  return equal;
}

bool compareAll(const Options &options) {
  Programs programs(options);
  if (options.cases.empty()) {
    Case one = options.one;
    std::vector<std::string> names = programs.names();
    if (one.pipe.empty()) {
      if (names.size() != 1)
        throw std::runtime_error("expected the name of a pipeline");
      one.pipe = names[0];
    }
    return compare(options, one, programs);
  }
  bool equal = true;
  for (const Case &input : readCases(options.cases)) {
    std::printf("%s:\n", input.pipe.c_str());
    std::fflush(stdout);
    alarm(options.timeout);
    try {
      equal &= compare(options, input, programs);
    } catch (const std::exception &error) {
      std::printf("error: %s\n", error.what());
      equal = false;
    }
  }
  return equal;
}

} // namespace

int main(int argc, char **argv) {
  // More threads than cores: to wait must not cost time.
  setenv("OMP_WAIT_POLICY", "passive", /*overwrite=*/0);
  try {
    return compareAll(parseOptions(argc, argv)) ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "piko-compare: %s\n", error.what());
    return 2;
  }
}
