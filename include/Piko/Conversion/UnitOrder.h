// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which block of a grid runs which unit of work.

#ifndef PIKO_CONVERSION_UNITORDER_H
#define PIKO_CONVERSION_UNITORDER_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include <optional>

namespace piko {

/// The piko.bins of a kernel, or the piko.items of a source; null if it has
/// neither.
mlir::Operation *findWork(KernelOp kernel);
/// Whose work that is.
mlir::FlatSymbolRefAttr getStageName(mlir::Operation *work);

/// How the blocks of a grid come to the units that they run.
enum class UnitOrder {
  Fixed,      ///< Block b of n runs the units b, b + n, ...: `direct_map`, and
              ///< `serialize`, of which there is one.
  Dispatched, ///< A block has one, which the hardware begins where another one
              ///< has ended; where there are more units than blocks of a grid,
              ///< it takes the next ones.
  Taken ///< It takes all of them: no pass has resolved the schedule, which
        ///< is the same for all bins.
};

/// Of a kernel at the machine level, or that opens bins, by what is resolved of
/// its stage's schedule; nothing for one that has no units.
std::optional<UnitOrder> getUnitOrder(KernelOp kernel);

} // namespace piko

#endif // PIKO_CONVERSION_UNITORDER_H
