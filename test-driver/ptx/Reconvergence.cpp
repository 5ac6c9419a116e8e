// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Reconvergence.cpp - Where the lanes of branches meet again ---------===//
//
// Immediate post-dominators of basic blocks, by the iteration of Cooper, Harvey
// and Kennedy, "A Simple, Fast Dominance Algorithm" (2001), on the reversed
// graph, from an exit after all returns.
//
//===----------------------------------------------------------------------===//

#include "ptx/text/Program.h"

#include <algorithm>

using namespace piko::ptx;

namespace {

class PostDominators {
public:
  PostDominators(Program &program, uint32_t first)
      : program(program), first(first),
        count(static_cast<uint32_t>(program.code.size()) - first) {}
  void setReconvergence();

private:
  void findBlocks();
  void addEdge(size_t from, size_t to);
  void orderBlocks();
  void solve();
  size_t intersect(size_t a, size_t b) const;
  const Instruction &at(uint32_t offset) const {
    return program.code[first + offset];
  }

  static constexpr size_t unknown = ~size_t(0);

  Program &program;
  const uint32_t first, count;
  std::vector<uint32_t> starts; ///< Of blocks, from `first` on.
  std::vector<size_t> blockOf;  ///< Of instructions.
  std::vector<std::vector<size_t>> successors, predecessors;
  std::vector<size_t> postorder; ///< Of the reversed graph, from the exit.
  std::vector<size_t> numbers, dominators;
  size_t exit = 0;
};

} // namespace

void PostDominators::findBlocks() {
  std::vector<bool> leads(count + 1, false);
  leads[0] = true;
  for (uint32_t i = 0; i < count; ++i) {
    const Instruction &it = at(i);
    if (it.flow == Flow::On)
      continue;
    leads[i + 1] = true;
    if (it.flow == Flow::Branch)
      leads[it.target - first] = true;
    if (it.flow == Flow::Table)
      for (uint32_t target : program.branchTables[it.extra])
        leads[target - first] = true;
  }
  for (uint32_t i = 0; i < count; ++i) {
    if (leads[i])
      starts.push_back(i);
    blockOf.push_back(starts.size() - 1);
  }
}

void PostDominators::addEdge(size_t from, size_t to) {
  successors[from].push_back(to);
  predecessors[to].push_back(from);
}

void PostDominators::orderBlocks() {
  numbers.assign(exit + 1, unknown);
  std::vector<std::pair<size_t, size_t>> stack{{exit, 0}};
  std::vector<bool> seen(exit + 1, false);
  seen[exit] = true;
  while (!stack.empty()) {
    auto &[block, next] = stack.back();
    if (next == predecessors[block].size()) {
      numbers[block] = postorder.size();
      postorder.push_back(block);
      stack.pop_back();
      continue;
    }
    size_t before = predecessors[block][next++];
    if (!seen[before]) {
      seen[before] = true;
      stack.emplace_back(before, 0);
    }
  }
}

size_t PostDominators::intersect(size_t a, size_t b) const {
  while (a != b) {
    while (numbers[a] < numbers[b])
      a = dominators[a];
    while (numbers[b] < numbers[a])
      b = dominators[b];
  }
  return a;
}

void PostDominators::solve() {
  dominators.assign(exit + 1, unknown);
  dominators[exit] = exit;
  for (bool changed = true; changed;) {
    changed = false;
    for (auto it = postorder.rbegin(); it != postorder.rend(); ++it) {
      if (*it == exit)
        continue;
      size_t found = unknown;
      for (size_t after : successors[*it])
        if (dominators[after] != unknown)
          found = found == unknown ? after : intersect(found, after);
      changed |= found != dominators[*it];
      dominators[*it] = found;
    }
  }
}

void PostDominators::setReconvergence() {
  findBlocks();
  exit = starts.size();
  successors.resize(exit + 1);
  predecessors.resize(exit + 1);
  for (size_t block = 0; block < exit; ++block) {
    uint32_t end = block + 1 < exit ? starts[block + 1] : count;
    const Instruction &last = at(end - 1);
    if (last.flow == Flow::Branch)
      addEdge(block, blockOf[last.target - first]);
    if (last.flow == Flow::Table)
      for (uint32_t target : program.branchTables[last.extra])
        addEdge(block, blockOf[target - first]);
    if (last.flow == Flow::End)
      addEdge(block, exit);
    if ((last.flow == Flow::On || last.guarded) && block + 1 < exit)
      addEdge(block, block + 1);
  }
  orderBlocks();
  solve();
  for (uint32_t i = 0; i < count; ++i) {
    Instruction &it = program.code[first + i];
    if (it.flow != Flow::Branch && it.flow != Flow::Table)
      continue;
    size_t meeting = dominators[blockOf[i]];
    it.reconverge = meeting == unknown || meeting == exit
                        ? nowhere
                        : first + starts[meeting];
  }
}

void piko::ptx::findReconvergence(Program &program, uint32_t first) {
  PostDominators(program, first).setReconvergence();
}
