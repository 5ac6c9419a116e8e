// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.h - A loop that runs in waves -----------------------------===//

#ifndef PIKO_RUNTIME_CPU_WAVELOOP_H
#define PIKO_RUNTIME_CPU_WAVELOOP_H

#include "cpu/Loop.h"

namespace piko::rt {

class WaveLoop : public Loop {
public:
  WaveLoop(pikort_pipeline &p, const LoopShape &shape);
  int32_t next() override;
  bool runsSerially(Kernel &kernel) const override;
  Stream takeInput() override;
  Items serialInput() override { return now_[running_]; }
  void absorb(Kernel &kernel) override;
  void absorb(const Serial &launch) override;

private:
  /// What one port emitted. All records of a kernel are numbered in the order
  /// of emission, over all ports.
  struct Port {
    int32_t edge;
    PortRecords records;
    Array<uint32_t> numbers;
    int64_t count() const { return records.stream.count; }
  };

  void begin() override;
  void absorbOne(const Serial &launch);
  void numberRecords(const Kernel &kernel, std::vector<Port> &ports,
                     uint32_t *items);
  /// `items[n]` is the item of the kernel's input from which record n comes.
  void absorb(std::vector<Port> &ports, const Array<uint32_t> &items);
  /// The nodes of what is now and, but for entries, its memory.
  std::vector<Queue> &current() { return queues_[turn_]; }
  std::vector<Queue> &later() { return queues_[1 - turn_]; }
  /// Puts what was emitted where it waits; record i is node base + numbers[i].
  void put(int32_t edge, const Items &emitted, int64_t base,
           const uint32_t *numbers);
  bool nextLevel();
  void flatten();
  void finish();
  void sortLeft(Edge &edge, Queue &left);
  [[noreturn]] void fail();

  // For each member: what has made hops_ hops, with its nodes in the tree, and
  // what has made one more. The order in a wave is free.
  std::vector<Items> now_;
  std::vector<Queue> queues_[2]; ///< current() and later() take turns.
  size_t turn_ = 0;
  std::vector<int32_t> exits_; ///< Edges.
  std::vector<Queue> left_;    ///< For each edge, in the order of waves.
  int64_t leftCount_ = 0;
  LineageTree tree_;
  int64_t hops_ = 0;
  size_t cursor_ = 0;  ///< The member whose turn comes.
  size_t running_ = 0; ///< The member that runs.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_WAVELOOP_H
