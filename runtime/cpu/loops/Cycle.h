// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Cycle.h - Runs a cycle of stages until nothing is left -------------===//
//
// A program runs a cycle in rounds of two steps:
//
//   1. spread   Loops, and the stages between them that do not collect, run
//               until all primitives have come to stages that collect, or have
//               left the cycle.
//   2. collect  The next stage that collects, in order, takes what it has; then
//               1. When all have had their turn and something is left, another
//               round begins.
//
// The runtime says where something waits. What the cycle's kernels emit goes to
// the queues of edges, where it is in lineage order: each launch of a stage
// that collects begins a new lineage. A cycle of stages that do not collect is
// one loop.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_CYCLE_H
#define PIKO_RUNTIME_CPU_CYCLE_H

#include "cpu/loops/Loop.h"

namespace piko::rt {

class Cycle {
public:
  Cycle(pikort_pipeline &p, int32_t number);

  /// The stage of a loop to run next, or -1 if it has come to rest.
  int32_t stepLoop(int32_t loop);
  /// Whether something waits for a stage outside of loops, which is to run
  /// then.
  bool takes(int32_t stage);
  /// The stage that collects whose turn it is, or -1 at the end.
  int32_t nextTurn();
  bool isFinished() const { return finished_; }
  /// Whether the launch of the stage that was named last is serial.
  bool runsSerially(Kernel &kernel) const;
  /// The input of that stage, once; that of a serial launch stays here.
  Stream takeInput(Kernel &kernel);
  Items serialInput(Kernel &kernel);
  /// Takes what its kernel emitted.
  void absorb(Kernel &kernel, bool serial);

private:
  struct Part {
    int32_t number; ///< Of the loop.
    std::unique_ptr<StageLoop> loop;
    bool started = false; ///< In this spread.
  };

  int32_t choose(int32_t stage);
  void expectNone() const;
  void finish();
  int32_t nextCollector();
  void beginRound();
  void expectChosen(const Kernel &kernel) const;
  bool takesFromOutside(const Stage &stage) const;
  Edge *onlyInput(const Stage &stage) const;
  void startLaunch(Kernel &kernel);
  void absorb(const Kernel &kernel, const Serial &launch);
  bool hasInput(const Stage &stage, bool fromOutside) const;
  bool comesFromOutside(const Stage &stage) const;

  pikort_pipeline &p_;
  const int32_t number_;
  const std::vector<int32_t> &stages_;
  std::vector<Part> loops_;
  std::vector<int32_t> collectors_; ///< In order of turns.
  size_t collector_ = 0;
  int64_t round_ = 0;
  int64_t launches_ = 0;    ///< Of collectors.
  bool fromOutside_ = true; ///< This spread takes what comes into the cycle.
  bool finished_ = false;
  int32_t chosen_ = -1;       ///< The stage whose kernel is to run.
  StageLoop *loop_ = nullptr; ///< Its loop, if it is of one.
  Queue input_;               ///< What a serial launch outside of loops takes.
  bool begun_ = false;        ///< It has its input.
};

/// Makes the cycles of a run, and frees them.
void startCycles(pikort_pipeline &p);
/// Begins the cycles of a group of stages anew, for another strip.
void restartCycles(pikort_pipeline &p, const StripGroup &group);
void endCycles(pikort_pipeline &p);

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_CYCLE_H
