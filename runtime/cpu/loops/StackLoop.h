// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StackLoop.h - A loop that runs one position at a time --------------===//

#ifndef PIKO_RUNTIME_CPU_STACKLOOP_H
#define PIKO_RUNTIME_CPU_STACKLOOP_H

#include "cpu/loops/Loop.h"

namespace piko::rt {

class StackLoop : public StageLoop {
public:
  StackLoop(pikort_pipeline &p, const LoopShape &shape) : StageLoop(p, shape) {}
  int32_t next() override;
  bool runsSerially(Kernel &) const override { return true; }
  Stream takeInput() override { return {}; } // no launch is another
  Items serialInput() override;
  void absorb(const Serial &launch) override;
  void absorb(Kernel &) override {}

private:
  /// An item in one of its buckets, or, if it leaves the loop, in all. Its
  /// record and its buckets are on stacks of their own.
  struct Waiting {
    int32_t edge; ///< By which it leaves, or -1.
    int32_t stage;
    int64_t hops;
    int64_t buckets;
  };
  struct Entry {
    uint32_t member, item;
  };
  /// What is left of what a port emitted; it is taken from the back.
  struct Tail {
    int32_t edge;
    const Serial::Emitted *emitted;
    int64_t count, pairs;
  };

  void begin() override;
  void push(const Waiting &waiting, const uint8_t *record,
            const uint32_t *buckets);
  void pushBuckets(int32_t stage, int64_t hops, const uint8_t *record,
                   const uint32_t *buckets, int64_t count);
  /// Takes the top of the stack.
  Items pop();
  void leave();
  void pushEntry(const Entry &entry);
  void pushLast(Tail &tail);

  Growing<Waiting> stack_;
  Growing<uint8_t> records_;
  Growing<uint32_t> buckets_;
  Waiting running_{};
  Growing<uint8_t> input_; ///< Its record.
  uint32_t inputBucket_ = 0;
  std::vector<Tail> tails_;
  Array<Entry> order_;                  ///< Of all entries.
  std::vector<Array<uint32_t>> starts_; ///< Of the pairs of the entries.
  int64_t nextEntry_ = 0;
  Array<uint64_t> key_; ///< Of what leaves.
  uint64_t left_ = 0;   ///< Records that have left the loop.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_STACKLOOP_H
