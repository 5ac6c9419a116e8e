// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Locals.cpp - Where the registers of a function live ----------------===//

#include "ptx/memory/Locals.h"

#include <algorithm>
#include <utility>

using namespace piko::ptx;

static bool isOneOf(std::string_view mnemonic,
                    std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), mnemonic) != names.end();
}

static bool endsBlock(std::string_view mnemonic) {
  return isOneOf(mnemonic, {"bra", "brx", "call", "ret", "exit", "trap"});
}

/// Whether a register that is the first operand may be read.
static bool readsFirst(std::string_view mnemonic) {
  return isOneOf(mnemonic, {"brx", "call", "bar", "barrier", "nanosleep"});
}

static std::string_view mnemonicOf(const Statement &it) {
  return it.opcode.substr(0, it.opcode.find('.'));
}

template <typename F>
static void forEachRegister(const Argument &argument, bool written,
                            F &function) {
  if (argument.kind == Argument::Register)
    function(argument.name, written);
  for (const Argument &part : argument.parts)
    forEachRegister(part, written && argument.kind != Argument::Address,
                    function);
}

/// Calls \p function with each register's name and whether it is written for
/// all lanes: those that are read come first.
template <typename F>
static void forEachRegister(const Statement &it, F function) {
  bool writes = it.guard.empty() && !readsFirst(mnemonicOf(it));
  if (!it.guard.empty())
    function(it.guard, false);
  for (size_t a = it.arguments.size(); a-- > 0;)
    forEachRegister(it.arguments[a], a == 0 && writes, function);
}

/// Whether a basic block begins at a statement, or after the last one.
static std::vector<bool> findLeaders(const FunctionSyntax &function) {
  std::vector<bool> leads(function.statements.size() + 1, false);
  for (const auto &[label, statement] : function.labels)
    leads[statement] = true;
  for (size_t i = 0; i < function.statements.size(); ++i)
    if (endsBlock(mnemonicOf(function.statements[i])))
      leads[i + 1] = true;
  return leads;
}

BlockLocals::BlockLocals(const FunctionSyntax &function)
    : ends(function.statements.size()) {
  std::vector<bool> leads = findLeaders(function);
  size_t block = 0;
  for (size_t i = 0; i < function.statements.size(); ++i) {
    block += leads[i];
    forEachRegister(function.statements[i],
                    [&](std::string_view name, bool written) {
                      this->name(name, i, block, written);
                    });
  }
  for (const auto &[name, life] : lives)
    if (life.local)
      ends[life.last].push_back(name);
}

void BlockLocals::name(std::string_view name, size_t statement, size_t block,
                       bool written) {
  auto [found, isNew] =
      lives.try_emplace(name, Life{block, statement, written});
  found->second.local &= found->second.block == block;
  found->second.last = statement;
}

bool BlockLocals::contains(std::string_view name) const {
  auto found = lives.find(name);
  return found != lives.end() && found->second.local;
}

void WrittenFirst::divide(const FunctionSyntax &function) {
  std::vector<bool> leads = findLeaders(function);
  for (const Statement &it : function.statements)
    forEachRegister(it, [&](std::string_view name, bool) {
      numbers.try_emplace(name, static_cast<uint32_t>(numbers.size()));
    });
  Set written = makeSet();
  for (size_t i = 0; i < function.statements.size(); ++i) {
    if (blocks.empty() || leads[i]) {
      if (!blocks.empty())
        for (uint32_t number : blocks.back().writes)
          written.remove(number);
      blocks.push_back({i, i, {}, {}, {}, std::nullopt});
    }
    blocks.back().end = i + 1;
    note(function.statements[i], blocks.back(), written);
  }
}

/// \p written: in the block, so far.
void WrittenFirst::note(const Statement &statement, Block &block,
                        Set &written) {
  forEachRegister(statement, [&](std::string_view name, bool writes) {
    uint32_t number = numbers.find(name)->second;
    if (written.contains(number))
      return;
    (writes ? block.writes : block.reads).push_back(number);
    if (writes)
      written.insert(number);
  });
}

void WrittenFirst::connect(const FunctionSyntax &function) {
  std::unordered_map<size_t, size_t> blockAt;
  for (size_t i = 0; i < blocks.size(); ++i)
    blockAt[blocks[i].begin] = i;
  auto add = [&](Block &block, const std::string &label) {
    auto found = function.labels.find(label);
    if (found == function.labels.end())
      return;
    if (auto at = blockAt.find(found->second); at != blockAt.end())
      block.successors.push_back(at->second);
  };
  for (size_t i = 0; i < blocks.size(); ++i) {
    const Statement &last = function.statements[blocks[i].end - 1];
    std::string_view mnemonic = mnemonicOf(last);
    const std::string &name =
        last.arguments.empty() ? last.guard : last.arguments.back().name;
    if (mnemonic == "bra")
      add(blocks[i], name);
    if (mnemonic == "brx")
      if (auto table = function.branchTargets.find(name);
          table != function.branchTargets.end())
        for (const std::string &label : table->second)
          add(blocks[i], label);
    bool goesOn = !endsBlock(mnemonic) || mnemonic == "call";
    if (i + 1 < blocks.size() && (goesOn || !last.guard.empty()))
      blocks[i].successors.push_back(i + 1);
  }
}

/// A path that is found later may only take registers away.
void WrittenFirst::spread() {
  blocks[0].before = makeSet();
  std::vector<size_t> pending{0};
  while (!pending.empty()) {
    const Block &block = blocks[pending.back()];
    pending.pop_back();
    Set written = *block.before;
    for (uint32_t number : block.writes)
      written.insert(number);
    for (size_t next : block.successors) {
      std::optional<Set> &before = blocks[next].before;
      Set both = written;
      for (size_t i = 0; before && i < both.words.size(); ++i)
        both.words[i] &= before->words[i];
      if (both == before)
        continue;
      before = std::move(both);
      pending.push_back(next);
    }
  }
}

WrittenFirst::WrittenFirst(const FunctionSyntax &function) {
  divide(function);
  others = makeSet();
  connect(function);
  if (blocks.empty())
    return;
  spread();
  for (const Block &block : blocks)
    for (uint32_t number : block.reads)
      if (!block.before || !block.before->contains(number))
        others.insert(number);
}
