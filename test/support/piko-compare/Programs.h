// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pipelines of a file as programs: compiled one by one, as users get them,
// and for the reference executor all at once. Each file is parsed once.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H

#include "Piko/Driver/CheckOptions.h"
#include "Piko/Driver/GPUOptions.h"
#include "Piko/Driver/SynthesisOptions.h"
#include "pikort/pikort.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

/// Code and the program in it; the code goes with the object.
struct Program {
  pikort_program program{};
  std::shared_ptr<void> code;
};

class Programs {
public:
  /// `pipe` is the only one that is wanted; empty = all. Throws
  /// std::runtime_error, as do all functions.
  Programs(const std::string &file, const std::string &reference,
           const std::string &pipe, const piko::CheckOptions &check,
           const piko::SynthesisOptions &synthesis,
           const piko::GPUOptions &gpu);
  ~Programs();

  /// The pipelines that can be read.
  std::vector<std::string> names() const;
  /// At most once for each.
  Program compile(const std::string &pipe);
  Program reference(const std::string &pipe);

private:
  struct Implementation;
  std::unique_ptr<Implementation> self;
};

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H
