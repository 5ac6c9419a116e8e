// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Executor.h - What runs a pipeline ----------------------------------===//
//
// The common part declares, binds and reports; a target's executor runs the
// kernels. It owns all that a run holds, and reads declarations and bindings
// from the pipeline. The functions that generated code calls while it runs are
// the target's own.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_COMMON_EXECUTOR_H
#define PIKO_RUNTIME_COMMON_EXECUTOR_H

#include <cstdint>
#include <memory>
#include <string>

struct pikort_pipeline;

namespace piko::rt {

struct KernelError;

class Executor {
public:
  virtual ~Executor() = default;

  /// The number of threads where the host does not say.
  virtual int32_t defaultThreads() const = 0;
  /// At most `wanted` of them: as many as the system gives the caller's runs.
  virtual int32_t availableThreads(int32_t wanted) const = 0;
  /// Once, when the declarations are complete; throws.
  virtual void prepare() = 0;
  /// Before the program runs, with grids computed: makes the state that the run
  /// needs. Throws, or sets the status.
  virtual void beginRun() = 0;
  /// Runs the program; returns its status. Where a device has all of it the
  /// run may go on, and the host goes on with awaitProgram.
  virtual int32_t runProgram() = 0;
  virtual bool isPending() const { return false; }
  /// Whether awaitProgram would not wait; throws.
  virtual bool isDone() const { return true; }
  /// Waits for the end of the run; returns its status. Throws.
  virtual int32_t awaitProgram() { return 0; }
  /// Whether the run was repeated, after what the device's stream had by then.
  virtual bool wasRepeated() const { return false; }
  /// After it, and after any error of beginRun: frees what the run held.
  virtual void endRun() = 0;

  // --- errors
  /// True if kernels report errors in the order of the sequential program, as
  /// in checking mode.
  virtual bool reportsInOrder() const = 0;
  /// The first error of the run was found now.
  virtual void noteError() = 0;
  /// Where the unit of an error is in an order that all ranks know.
  virtual int64_t placeOf(const KernelError &) const { return 0; }
  /// The message of an error whose text is `plain`, with all that is known of
  /// where it was found.
  virtual std::string describe(int32_t code,
                               const std::string &plain) const = 0;
};

/// The executor of a pipeline that is about to be declared; of the target.
std::unique_ptr<Executor> makeExecutor(pikort_pipeline &p);

} // namespace piko::rt

#endif // PIKO_RUNTIME_COMMON_EXECUTOR_H
