// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CPUExecutor.h - Runs a pipeline on threads of the CPU --------------===//
//
// Owns what runs have: for each stage, source, edge, cycle and group of strips
// of the pipeline what the CPU keeps of it, under the same number.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_CPUEXECUTOR_H
#define PIKO_RUNTIME_CPU_CPUEXECUTOR_H

#include "common/Pipeline.h"
#include "cpu/Threads.h"
#include "pikort/grid.h"

#include <map>

namespace piko::rt {

class Checker;  // Check.h
struct Items;   // Kernel.h
struct Kernel;  // Kernel.h
struct Queue;   // Queue.h
class Cycle;    // Cycle.h
class Strips;   // Strips.h
struct GridLog; // gpu/Log.cpp

struct CPUExecutor : Executor {
  explicit CPUExecutor(pikort_pipeline &p);
  ~CPUExecutor() override;

  int32_t defaultThreads() const override { return rt::defaultThreads(); }
  int32_t availableThreads(int32_t wanted) const override {
    return rt::availableThreads(wanted);
  }
  void prepare() override;
  void beginRun() override;
  int32_t runProgram() override;
  void endRun() override;
  /// Drops what kernels hold of a run.
  void clearKernels();
  bool reportsInOrder() const override { return checker != nullptr; }
  void noteError() override;
  int64_t placeOf(const KernelError &error) const override;
  std::string describe(int32_t code, const std::string &plain) const override;

  // --- what kernels see: here, what there is
  /// Before the program runs: lets kernels reach state and sources; throws.
  virtual void showState() {}
  /// After it: state and sources are the host's again, with what kernels have
  /// written.
  virtual void takeState() {}
  /// Of a serial launch, whose primitives lie in `from`; throws.
  virtual void showSerial(Kernel &, const Items &from) {}
  /// The input of a kernel that is ready to run; throws.
  virtual const pikoir_input *show(Kernel &kernel);

  pikort_pipeline &p;
  /// How many units run at once where blocks of threads run them; 0: a thread
  /// runs a unit.
  int64_t blocksAtOnce = 0;
  // Warm from run to run:
  std::vector<std::unique_ptr<Kernel>> kernels; ///< Of stages.
  /// Of sources; null where the consumer is not placed.
  std::vector<std::unique_ptr<Kernel>> sourceKernels;
  std::unique_ptr<Checker> checker; ///< In checking mode.

  // Of a run:
  std::vector<std::unique_ptr<Cycle>> cycles;
  std::vector<std::unique_ptr<Strips>> strips;
  /// Of edges whose producer is on a cycle, or that leave strips: what has been
  /// emitted so far.
  std::vector<std::unique_ptr<Queue>> queues;
  std::vector<bool> cleared; ///< Of stages: their images are clear.
  int32_t activeThreads = 1; ///< That the open kernel has units for.
  /// Of grids that have begun, by where their threads find them.
  std::map<const pikoir_log *, std::shared_ptr<GridLog>> logs;
};

inline CPUExecutor &cpuOf(const pikort_pipeline &p) {
  return static_cast<CPUExecutor &>(*p.executor);
}

inline Kernel &kernelOf(const pikort_pipeline &p, int32_t stage) {
  return *cpuOf(p).kernels[static_cast<size_t>(stage)];
}

/// Of an edge that has one, of those of the pipeline.
inline Queue &queueOf(const pikort_pipeline &p, const Edge &edge) {
  return *cpuOf(p).queues[static_cast<size_t>(&edge - p.edges.data())];
}

/// The cycle that a stage is on, or null.
inline Cycle *cycleOf(const pikort_pipeline &p, const Stage &stage) {
  return stage.cycle < 0
             ? nullptr
             : cpuOf(p).cycles[static_cast<size_t>(stage.cycle)].get();
}

/// The strips that a stage takes, or null.
inline Strips *stripsOf(const pikort_pipeline &p, const Stage &stage) {
  return stage.stripGroup < 0
             ? nullptr
             : cpuOf(p).strips[static_cast<size_t>(stage.stripGroup)].get();
}

/// In checking mode, what checks; else null.
inline Checker *checkerOf(const pikort_pipeline &p) {
  return cpuOf(p).checker.get();
}

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_CPUEXECUTOR_H
