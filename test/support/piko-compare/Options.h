// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko-compare is asked for.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_OPTIONS_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_OPTIONS_H

#include "Piko/Driver/CheckOptions.h"
#include "Piko/Driver/GPUOptions.h"
#include "Piko/Driver/Options.h"
#include "Piko/Driver/SynthesisOptions.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// One pipeline and its input.
struct Case {
  std::string pipe;
  std::vector<int64_t> domain{64, 48};
  /// Primitives of each source; the last number is for all that follow.
  std::vector<int64_t> counts{1000};
  int64_t elements = 64; ///< Of each buffer.
  unsigned seed = 1;
  /// Input of all bits, infinities and NaNs among it.
  bool wide = false;
  /// Of hops and rounds; 0 = as it is.
  int64_t loopLimit = 0;
  /// Primitives of a source in a strip, 0 = all.
  int64_t strip = 0;
  /// What bins may hold, in bytes; 0 = no budget.
  int64_t budget = 0;
  /// A file that pikort_capture has written: the input in place of all the above but
  /// `pipe`. Empty = none.
  std::string capture;

  int64_t count(size_t source) const {
    return counts[source < counts.size() ? source : counts.size() - 1];
  }
};

/// What the compiled pipelines run on.
struct Target {
  /// As --targets names it; empty where there is but one.
  std::string name;
  /// The processor, as pikoc has it; of another architecture after its name and a
  /// colon, until that is in `arch`.
  std::string cpu = "native";
  /// --target gpu-on-cpu, --gpu-threads N (0 = as the stage says), --gpu-seed N,
  /// --gpu-blocks N (0 = as many as there are units), --gpu-chip NAME,..
  piko::GPUOptions gpu = {};
  /// Where this machine does not run its code, as pikoc has it.
  std::string arch = {};
};

struct Options {
  std::string help; ///< the text, if that is asked for
  std::string file;
  /// The C++ that the reference executor runs.
  std::string reference;
  Case one;
  /// A file with the options of a case in each line, or of C++ in each line after
  /// `// CASE: `, where all cases must write something; empty = the one case. What a
  /// case leaves out is as in `one`.
  std::string cases;
  std::vector<int> threads{1, 2, 7};
  int runs = 3;
  unsigned timeout = 0;
  /// The words of a command that begins piko-run-capture on a machine of another
  /// architecture, or under an emulator.
  std::vector<std::string> runner;
  /// The largest relative difference of a number of a pipeline that has a stage
  /// which is not strict. Without it, differences are reported, and are right.
  std::optional<double> tolerance;
  /// At least one. The first one runs with all threads, as often as `runs` says;
  /// the others once, with the last number of threads.
  std::vector<Target> targets;
  /// A case runs on the first target and on one of the others, which take turns with
  /// the cases; a file's name says which begins.
  bool spread = false;
  /// All cases are to stop, with a message that is the same in all runs on all
  /// targets.
  bool stops = false;
  /// How much LLVM optimizes its code: -O0 to -O3. For other processors than the
  /// first target's it is less unless asked for: what sets them apart is done before its optimizer, and after it from -O1 on. What runs beside a GPU, or
  /// emulates one, is not optimized: it is the passes that divide kernels among threads
  /// which are tested there, and the kernels' PTX is optimized.
  std::optional<int> optLevel;
  int getOptLevel(const Target &target) const {
    bool isFirst = &target == &targets.front();
    bool isGPU = target.gpu.target != piko::GPUTarget::None;
    return optLevel.value_or(isGPU ? 0 : isFirst ? 3 : 1);
  }
  /// Says which threads ran which bins.
  bool owners = false;
  /// Checking mode, on both sides.
  piko::CheckOptions check;
  piko::SynthesisOptions synthesis;
  /// Of the reference executor's code; --no-cache.
  piko::CacheOptions cache;
};

/// Both throw std::runtime_error.
Options parseOptions(int argc, char **argv);
std::vector<Case> readCases(const Options &options);
bool hasOwnCases(const Options &options);

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_OPTIONS_H
