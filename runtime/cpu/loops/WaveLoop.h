// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WaveLoop.h - A loop that runs in waves -----------------------------===//

#ifndef PIKO_RUNTIME_CPU_WAVELOOP_H
#define PIKO_RUNTIME_CPU_WAVELOOP_H

#include "cpu/loops/Loop.h"

namespace piko::rt {

class WaveLoop : public StageLoop {
public:
  using StageLoop::StageLoop;
  int32_t next() override;
  bool runsSerially(Kernel &kernel) const override;
  Stream takeInput() override;
  Items serialInput() override { return now_[running_]; }
  void absorb(Kernel &kernel) override;
  void absorb(const Serial &launch) override;

private:
  /// What one port emitted: of which edge, and where its nodes begin.
  struct Port {
    int32_t edge;
    PortRecords records;
    int64_t firstNode = 0;
    int64_t count() const { return records.stream.count; }
  };
  /// A port while its records are numbered: what comes from the next slot on.
  struct PortCursor {
    const uint32_t *counts; ///< Of all slots.
    const uint32_t *ordinals;
    uint32_t *nodes;
    int64_t next = 0; ///< How many came before.
    void advance(int64_t records) {
      ordinals += records;
      nodes += records;
      next += records;
    }
  };
  using Cursors = std::vector<PortCursor>; ///< Of all ports.

  void begin() override;
  void absorbOne(const Serial &launch);
  std::vector<Cursors> findChunks(const std::vector<Port> &ports,
                                  int64_t slots);
  void numberRecords(const Kernel &kernel, const std::vector<Port> &ports);
  /// The nodes of what is now and, but for entries, its memory.
  std::vector<Queue> &current() { return queues_[turn_]; }
  std::vector<Queue> &later() { return queues_[1 - turn_]; }
  uint32_t nodeOf(uint32_t item) {
    const Growing<uint32_t> &nodes = current()[running_].nodes;
    return nodes.size() > 0 ? nodes[item] : item;
  }
  /// Where what comes along an edge waits.
  Queue &queueAfter(const Edge &edge);
  /// Puts what was emitted there; record i is node base + numbers[i].
  void put(int32_t edge, const Items &emitted, int64_t base,
           const uint32_t *numbers);
  void noteCount(const Edge &edge, const Items &emitted);
  bool nextLevel();
  void flatten();
  void finish();
  void joinLeft(Edge &edge);
  Array<uint32_t> rankPlaces(const std::vector<Stream> &streams,
                             const Places &places) const;
  [[noreturn]] void fail();

  // For each member: what has made hops_ hops, with its nodes in the tree, and
  // what has made one more. The order in a wave is free. Without nodes: those
  // of the entries are their numbers.
  std::vector<Items> now_;
  std::vector<Queue> queues_[2]; ///< current() and later() take turns.
  size_t turn_ = 0;
  std::vector<Queue> left_; ///< For each edge, in the order of waves.
  int64_t leftCount_ = 0;
  LineageTree tree_;
  int64_t hops_ = 0;
  size_t cursor_ = 0;  ///< The member whose turn comes.
  size_t running_ = 0; ///< The member that runs.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_WAVELOOP_H
