// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that count, written with a condition.

#ifndef PIKO_TRANSFORMS_STORAGE_COUNTEDWHILES_H
#define PIKO_TRANSFORMS_STORAGE_COUNTEDWHILES_H

#include "Piko/Analysis/CountedLoop.h"

namespace piko {

/// A loop that an scf.for can count in 64 bits: by one, up to a number or below
/// it.
std::optional<CountedLoop> findUpliftableWhile(mlir::scf::WhileOp loop);

/// `results`, if not null, gets what stands for those of the loop.
mlir::scf::ForOp
upliftWhile(mlir::scf::WhileOp loop, const CountedLoop &counted,
            llvm::SmallVectorImpl<mlir::Value> *results = nullptr);

/// Makes loops that count of those inside of which one knows how often they
/// iterate, in 64 bits.
void upliftWhiles(mlir::scf::ForOp root);

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_COUNTEDWHILES_H
