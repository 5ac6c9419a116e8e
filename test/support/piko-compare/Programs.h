// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pipelines of a file as programs: compiled one by one for each target, as
// users get them, and for the reference executor all at once, both through the disk
// cache. The file is read once, however many targets there are.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H

#include "Options.h"

#include "pikort/pikort.h"

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

/// What the compiler said beside what could not be done; what() has both.
class NotCompiled : public std::runtime_error {
public:
  NotCompiled(const std::string &what, const std::string &diagnostics)
      : runtime_error(what + "\n" + diagnostics), reason(what),
        diagnostics(diagnostics) {}
  std::string reason, diagnostics;
};

/// Code and the program in it; the code goes with the object.
struct Program {
  pikort_program program{};
  std::shared_ptr<void> code;
  /// Whether all stages give the bits of the reference executor.
  bool isStrict = true;
};

/// The object of a pipeline, with the functions `pipe`.setup and `pipe`.run.
struct CompiledPipeline {
  std::string code;
  bool isStrict;
};

class Programs {
public:
  /// Throws std::runtime_error, as do all functions.
  explicit Programs(const Options &options);
  ~Programs();

  /// The pipelines that can be read.
  std::vector<std::string> names() const;
  /// At most once for each.
  Program compile(const std::string &pipe, const Target &target);
  CompiledPipeline compileObject(const std::string &pipe, const Target &target);
  Program reference(const std::string &pipe);

private:
  struct Implementation;
  std::unique_ptr<Implementation> self;
};

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_PROGRAMS_H
