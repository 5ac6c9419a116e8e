// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Locals.h - Where the registers of a function live ------------------===//
//
// PTX has as many virtual registers as its compiler had values, thousands in a
// large kernel, and most of them live within one basic block. Those whose lives
// do not overlap share a place, so that the registers of a warp stay in the
// processor's caches. Nor need a block of threads fill those again that are
// written before they are read, which is more work than many a block does.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_LOCALS_H
#define PIKO_TEST_DRIVER_PTX_LOCALS_H

#include "ptx/text/Syntax.h"

#include <optional>
#include <string_view>
#include <unordered_map>

namespace piko::ptx {

/// The registers of a function that are named in one basic block only, and
/// first by an instruction without a guard that writes them. Nothing sees what
/// their place held before.
class BlockLocals {
public:
  explicit BlockLocals(const FunctionSyntax &function);

  bool contains(std::string_view name) const;
  /// Those that no statement after this one names.
  const std::vector<std::string_view> &endingAt(size_t statement) const {
    return ends[statement];
  }

private:
  struct Life {
    size_t block, last;
    bool local;
  };
  void name(std::string_view name, size_t statement, size_t block,
            bool written);

  std::unordered_map<std::string_view, Life> lives;
  std::vector<std::vector<std::string_view>> ends; ///< By statement.
};

/// The registers of a function that are written on each path to where they are
/// read. Nothing sees what their place held when the function began.
class WrittenFirst {
public:
  explicit WrittenFirst(const FunctionSyntax &function);

  bool contains(std::string_view name) const {
    auto found = numbers.find(name);
    return found != numbers.end() && !others.contains(found->second);
  }

private:
  /// Of registers, by their numbers.
  class Set {
  public:
    bool contains(uint32_t number) const {
      return words[number / 64] >> number % 64 & 1;
    }
    void insert(uint32_t number) {
      words[number / 64] |= uint64_t(1) << number % 64;
    }
    void remove(uint32_t number) {
      words[number / 64] &= ~(uint64_t(1) << number % 64);
    }
    bool operator==(const Set &) const = default;

    std::vector<uint64_t> words;
  };
  Set makeSet() const {
    return {std::vector<uint64_t>(numbers.size() / 64 + 1)};
  }
  struct Block {
    size_t begin, end; ///< Of statements.
    std::vector<size_t> successors;
    std::vector<uint32_t> writes; ///< Each once.
    std::vector<uint32_t> reads;  ///< Of what it has not written before.
    std::optional<Set> before; ///< Written when it begins, if a path is known.
  };
  void divide(const FunctionSyntax &function);
  void note(const Statement &statement, Block &block, Set &written);
  void connect(const FunctionSyntax &function);
  void spread();

  std::unordered_map<std::string_view, uint32_t> numbers;
  std::vector<Block> blocks;
  Set others;
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_LOCALS_H
