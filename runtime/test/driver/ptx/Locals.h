// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Locals.h - Registers of one basic block ----------------------------===//
//
// PTX has as many virtual registers as its compiler had values, thousands in a
// large kernel, and most of them live within one basic block. Those whose lives
// do not overlap share a place, so that the registers of a warp stay in the
// processor's caches.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_LOCALS_H
#define PIKO_TEST_DRIVER_PTX_LOCALS_H

#include "ptx/Syntax.h"

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
  /// Those that no statement behind this one names.
  const std::vector<std::string_view> &endingAt(size_t statement) const {
    return ends[statement];
  }

private:
  struct Life {
    size_t block, last;
    bool local;
  };
  void name(const Argument &argument, size_t statement, size_t block,
            bool written);
  void name(std::string_view name, size_t statement, size_t block,
            bool written);

  std::unordered_map<std::string_view, Life> lives;
  std::vector<std::vector<std::string_view>> ends; ///< By statement.
};

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_LOCALS_H
