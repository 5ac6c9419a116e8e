// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the driver is asked for. No header of LLVM is needed here.

#ifndef PIKO_DRIVER_OPTIONS_H
#define PIKO_DRIVER_OPTIONS_H

#include "piko/macros_begin.h"

#include "Piko/Driver/CPUOptions.h"
#include "Piko/Driver/CheckOptions.h"
#include "Piko/Driver/GPUOptions.h"
#include "Piko/Driver/SynthesisOptions.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace piko {

/// What executes a pipeline.
enum class ExecutionTarget {
  CPU,      ///< Compiled, on all threads that the host allows.
  Reference ///< The reference executor of piko.h: sequential, and the measure.
};

/// Where compiled code, and what Clang knows of piko.h, is kept from one
/// process to the next.
struct CacheOptions {
  bool enabled = true;
  /// Empty = $PIKO_CACHE_DIR, $XDG_CACHE_HOME/piko or $HOME/.cache/piko, the
  /// first that there is.
  std::string directory = {};
  /// The oldest entries go when it is larger; 0 = $PIKO_CACHE_SIZE, in bytes,
  /// or 512 MiB.
  uint64_t maxBytes = 0;
};

/// The namespace of an object's symbol and header where none is asked for.
inline constexpr const char *defaultNamespace = "pipelines";

/// The names of tunables of a text, each with one of the values that it lists.
using TunableSettings = std::vector<std::pair<std::string, std::string>>;

/// A pipeline and how its text is read.
struct CompileOptions {
  /// A pipeline's C++, or `.mlir` at the authored level.
  std::string file;
  /// The pipeline to compile; empty = the only one in the file.
  std::string pipeName = {};
  /// `-I` and `-D`, without the letter.
  std::vector<std::string> includeDirs = {}, defines = {};
  TunableSettings tunables = {};
  /// The file's text, where it is not on disk; `file` is then only its name.
  std::optional<std::string> text = {};
  CheckOptions check = {};
  SynthesisOptions synthesis = {};
  GPUOptions gpu = {};
  CacheOptions cache = {};
  /// Whether what C++ means may come from the cache, where the text is as it
  /// was.
  bool reusesAuthored = true;
};

/// Instruments code, which then runs in programs that have the sanitizer's
/// runtime and a libpikort that is built with it.
enum class Sanitizer { None, Address, Thread };

/// What code is made for.
struct TargetOptions {
  /// As LLVM names processors; "native" is this machine's, with all that it
  /// offers, and empty is the least that objects are made for. An object may
  /// have code for several, between commas: the last one runs that fits the
  /// machine.
  std::string cpu = {};
  /// 0 to 3, as in -O3.
  int optLevel = 3;
  Sanitizer sanitizer = Sanitizer::None;
  /// LLVM's own vectors, of inner loops and of what stands in a row.
  bool loopVectorize = true, slpVectorize = true;
  /// x86_64 or aarch64; empty = this machine's. The text is read as on this
  /// machine, whatever its code is for.
  std::string arch = {};

  /// The same without LLVM's passes that synthesis does without.
  TargetOptions leaveOut(const SynthesisOptions &synthesis) const {
    TargetOptions options = *this;
    options.loopVectorize &= synthesis.has("loop-vectorize");
    options.slpVectorize &= synthesis.has("slp-vectorizer");
    return options;
  }

  /// Without vectors, if the code is for the thread sanitizer, which does not
  /// see what they access by gathers, scatters and masks.
  SynthesisOptions leaveOutUnseen(SynthesisOptions synthesis) const {
    if (sanitizer == Sanitizer::Thread)
      for (const char *pass : {"vectorize", "loop-vectorize", "slp-vectorizer"})
        synthesis.without.push_back(pass);
    return synthesis;
  }
};

} // namespace piko

#include "piko/macros_end.h"

#endif // PIKO_DRIVER_OPTIONS_H
