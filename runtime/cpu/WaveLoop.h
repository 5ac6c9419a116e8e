// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.h - A loop that runs in waves -----------------------------===//

#ifndef PIKO_RUNTIME_CPU_WAVELOOP_H
#define PIKO_RUNTIME_CPU_WAVELOOP_H

#include "cpu/Loop.h"

namespace piko::rt {

class WaveLoop : public Loop {
public:
  WaveLoop(pikort_pipeline &p, const LoopShape &shape) : Loop(p, shape) {}
  int32_t next() override;
  Stream takeInput() override;

private:
  void begin() override;
  void absorb(std::vector<Port> &ports, Array<uint32_t> items) override;
  bool nextLevel();
  void flatten();
  void finish();
  void sortLeft(Edge &edge, Queue &left);
  [[noreturn]] void fail();

  // For each member: what has made hops_ hops, with its nodes in the tree, and
  // what has made one more. The order in a wave is free.
  std::vector<Stream> now_;
  std::vector<Growing<uint32_t>> nodes_;
  std::vector<Queue> later_;
  std::vector<Queue> left_; ///< For each edge, in the order of waves.
  LineageTree tree_;
  Growing<uint32_t> waveNodes_; ///< Of the input of the stage that runs.
  int64_t hops_ = 0;
  size_t cursor_ = 0;  ///< The member whose turn comes.
  size_t running_ = 0; ///< The member that runs.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_WAVELOOP_H
