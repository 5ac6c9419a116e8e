// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- LineageTree.h - The order of what a loop emits ---------------------===//
//
// A loop runs in waves, but its primitives are in depth-first order. The tree
// has a node for each primitive that came into the loop (a root) or was emitted
// in it. A node's children are numbered in the order in which they were
// emitted, and after it. Counting the leaves below each node from the last node
// to the first, and summing from the first to the last, gives the place of each
// leaf in depth-first order.
//
// The tree is flattened whenever it has grown to twice its leaves: these become
// the roots, in order. So it costs a constant for each primitive, and is no
// larger than what is pending in the loop and has left it.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_RUNTIME_CPU_LINEAGETREE_H
#define PIKO_RUNTIME_CPU_LINEAGETREE_H

#include "cpu/Queue.h"

namespace piko::rt {

class LineageTree {
public:
  /// A tree of `roots`, each the entry of its own number. If that is never
  /// asked for, it is not kept.
  void reset(int64_t roots, bool keepsEntries);
  int64_t size() const { return roots_ + parents_.size(); }
  /// Adds nodes; the caller sets the parent of each.
  uint32_t *extend(Memory &memory, int64_t count) {
    return parents_.extend(memory, count);
  }
  /// True if it pays to flatten a tree that has so many leaves.
  bool isTall(int64_t leaves) const { return size() > 2 * leaves + 4096; }
  /// Numbers the leaves, which `lists` name, 0, 1, ... in depth-first order and
  /// makes them the roots; what is not a leaf is forgotten.
  void flatten(Memory &memory, const std::vector<Growing<uint32_t> *> &lists);
  /// The entry that a root comes from.
  int64_t entry(int64_t root) const { return entries_ ? entries_[root] : root; }

private:
  Array<uint32_t> findEntries(Memory &memory) const;

  int64_t roots_ = 0;
  bool keepsEntries_ = true;
  Growing<uint32_t> parents_; ///< Of all nodes but the roots.
  Array<uint32_t> entries_;   ///< Of the roots; none = identity.
};

} // namespace piko::rt

#endif // PIKO_RUNTIME_CPU_LINEAGETREE_H
