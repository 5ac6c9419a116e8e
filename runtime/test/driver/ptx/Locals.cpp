// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Locals.cpp - Registers of one basic block --------------------------===//

#include "ptx/Locals.h"

#include <algorithm>

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

BlockLocals::BlockLocals(const FunctionSyntax &function)
    : ends(function.statements.size()) {
  std::vector<bool> leads(function.statements.size() + 1, false);
  for (const auto &[label, statement] : function.labels)
    leads[statement] = true;
  size_t block = 0;
  for (size_t i = 0; i < function.statements.size(); ++i) {
    const Statement &it = function.statements[i];
    std::string_view mnemonic = it.opcode.substr(0, it.opcode.find('.'));
    block += leads[i];
    // What is read, before what is written.
    bool writes = it.guard.empty() && !readsFirst(mnemonic);
    if (!it.guard.empty())
      name(it.guard, i, block, false);
    for (size_t a = it.arguments.size(); a-- > 0;)
      name(it.arguments[a], i, block, a == 0 && writes);
    leads[i + 1] = leads[i + 1] || endsBlock(mnemonic);
  }
  for (const auto &[name, life] : lives)
    if (life.local)
      ends[life.last].push_back(name);
}

void BlockLocals::name(const Argument &argument, size_t statement, size_t block,
                       bool written) {
  if (argument.kind == Argument::Register)
    name(argument.name, statement, block, written);
  for (const Argument &part : argument.parts)
    name(part, statement, block, written && argument.kind != Argument::Address);
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
