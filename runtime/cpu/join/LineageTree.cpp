// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- LineageTree.cpp - The order of what a loop emits -------------------===//

#include "cpu/join/LineageTree.h"

using namespace piko::rt;

void LineageTree::reset(int64_t roots, bool keepsEntries) {
  roots_ = roots;
  keepsEntries_ = keepsEntries;
  parents_.take();
  entries_ = {};
}

/// Of all nodes.
Array<uint32_t> LineageTree::findEntries(Memory &memory) const {
  Array<uint32_t> entries(memory, size());
  for (int64_t root = 0; root < roots_; ++root)
    entries[root] = static_cast<uint32_t>(entry(root));
  for (int64_t node = roots_; node < size(); ++node)
    entries[node] = entries[parents_[node - roots_]];
  return entries;
}

void LineageTree::flatten(Memory &memory,
                          const std::vector<Growing<uint32_t> *> &lists) {
  int64_t nodes = size();
  // First the number of leaves below each node, then the first leaf's place.
  Array<uint32_t> place(memory, nodes);
  std::memset(place.data(), 0, static_cast<size_t>(nodes) * 4);
  for (Growing<uint32_t> *list : lists)
    for (int64_t i = 0; i < list->size(); ++i)
      place[(*list)[i]] = 1;
  for (int64_t node = nodes - 1; node >= roots_; --node)
    place[parents_[node - roots_]] += place[node];
  uint32_t leaves = 0;
  for (int64_t root = 0; root < roots_; ++root)
    leaves += std::exchange(place[root], leaves);
  // A node that is not a leaf is not asked for its place again: it counts on
  // for its children.
  for (int64_t node = roots_; node < nodes; ++node) {
    uint32_t parent = parents_[node - roots_];
    uint32_t below = place[node];
    place[node] = place[parent];
    place[parent] += below;
  }
  Array<uint32_t> entries, kept;
  if (keepsEntries_) {
    entries = findEntries(memory);
    kept = Array<uint32_t>(memory, leaves);
  }
  for (Growing<uint32_t> *list : lists)
    for (int64_t i = 0; i < list->size(); ++i) {
      uint32_t &node = (*list)[i];
      if (kept)
        kept[place[node]] = entries[node];
      node = place[node];
    }
  roots_ = leaves;
  parents_.shrink(0);
  entries_ = std::move(kept);
}
