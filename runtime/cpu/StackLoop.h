// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- StackLoop.h - A loop that runs one position at a time --------------===//

#ifndef PIKO_RUNTIME_CPU_STACKLOOP_H
#define PIKO_RUNTIME_CPU_STACKLOOP_H

#include "cpu/Loop.h"

namespace piko::rt {

class StackLoop : public Loop {
public:
  StackLoop(pikort_pipeline &p, const LoopShape &shape) : Loop(p, shape) {}
  int32_t next() override;
  Stream takeInput() override;

private:
  /// An item in one of its cells, or, if it leaves the loop, in all. Its record
  /// and its cells are on stacks of their own.
  struct Waiting {
    int32_t edge; ///< By which it leaves, or -1.
    int32_t stage;
    int64_t hops;
    int64_t cells;
  };
  struct Entry {
    uint32_t member, item;
  };

  void begin() override;
  void absorb(std::vector<Port> &ports, Array<uint32_t> items) override;
  void push(const Waiting &waiting, const uint8_t *record,
            const uint32_t *cells);
  void pushCells(int32_t stage, int64_t hops, const Stream &stream,
                 int64_t item, const Array<uint32_t> &pairStarts);
  /// Takes the top of the stack.
  Stream pop();
  void leave();

  Growing<Waiting> stack_;
  Growing<uint8_t> records_;
  Growing<uint32_t> cells_;
  Waiting running_{};
  Array<Entry> order_;                  ///< Of all entries.
  std::vector<Array<uint32_t>> starts_; ///< Of the pairs of the entries.
  int64_t nextEntry_ = 0;
  uint64_t left_ = 0; ///< Records that have left the loop.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_STACKLOOP_H
