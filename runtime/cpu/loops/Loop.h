// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Loop.h - A cycle of stages that do not collect ---------------------===//
//
// What comes into a loop, and all that follows from it, is in depth-first
// order. It runs in one of two ways:
//
//   WaveLoop    all primitives of a stage that have made the same number of
//               hops at once, in parallel; a LineageTree remembers the order;
//   StackLoop   if the order of some stage's calls can be seen: one position at
//               a time, from a stack.
//
// What leaves the loop goes, in order, to the queues of its edges; of several
// that lead to one stage, to that of the first. Its key is that of the entry
// that it comes from, and its place among all that left.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_LOOP_H
#define PIKO_RUNTIME_CPU_LOOP_H

#include "cpu/Serial.h"
#include "cpu/join/LineageTree.h"

namespace piko::rt {

class StageLoop {
public:
  StageLoop(pikort_pipeline &p, const LoopShape &shape);
  static std::unique_ptr<StageLoop> make(pikort_pipeline &p,
                                         const LoopShape &shape);
  virtual ~StageLoop() = default;

  /// Takes what has come into the loop's stages.
  void start(bool fromOutside);
  /// The stage to run next, or -1 if nothing is left: then the queues of the
  /// edges out of the loop are complete.
  virtual int32_t next() = 0;
  /// Whether its launch is serial.
  virtual bool runsSerially(Kernel &kernel) const = 0;
  /// The input of that stage, once; that of a serial launch stays in the loop.
  virtual Stream takeInput() = 0;
  virtual Items serialInput() = 0;
  /// Takes what that stage's kernel emitted.
  virtual void absorb(Kernel &kernel) = 0;
  virtual void absorb(const Serial &launch) = 0;

protected:
  virtual void begin() = 0;

  size_t members() const { return shape_.stages.size(); }
  const Stage &member(size_t m) const { return p_.stages[shape_.stages[m]]; }
  size_t memberOf(int32_t stage) const {
    size_t m = 0;
    while (shape_.stages[m] != stage)
      ++m;
    return m;
  }
  int64_t recordSize(const Stage &stage) const {
    return p_.records[stage.record].size;
  }
  /// The words of the key of what left at `place`, if it has keys.
  void writeKey(const Edge &edge, uint64_t *key, int64_t entry,
                uint64_t place) const;
  /// To where what leaves by an edge goes: the first edge to the same stage,
  /// which gets all in order.
  Edge &exitTo(const Edge &edge) const;
  [[noreturn]] void failHops(const Stage &stage, int64_t bucket,
                             const uint8_t *record) const;

  pikort_pipeline &p_;
  const LoopShape &shape_;
  std::vector<int32_t> exits_;  ///< Edges.
  std::vector<Stream> entries_; ///< For each member.
  /// For each member, the places of its entries among all; none = identity.
  std::vector<Array<uint32_t>> places_;
  int64_t entryCount_ = 0;

private:
  Array<uint64_t> keys_; ///< Of the entries, by place.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_LOOP_H
