// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Structured work as loops over what is stored, for every target: units of
// work, in them buckets or calls, in them primitives.

#ifndef PIKO_TRANSFORMS_STORAGE_UNITFORMER_H
#define PIKO_TRANSFORMS_STORAGE_UNITFORMER_H

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/PatternMatch.h"

namespace piko {

/// A target may say who runs a unit, and where that leaves what it emits; here
/// they are the CPU's.
class UnitFormer {
public:
  /// `work` is the kernel's: a piko.bins, or the piko.items of a source.
  UnitFormer(KernelOp kernel, mlir::Operation *work)
      : loc(kernel.getLoc()), work(work), rewriter(work) {}
  virtual ~UnitFormer() = default;
  void run();

protected:
  /// Opens `bins` and makes what runs units: `unit` is the number of one, whose
  /// work goes before `unitEnd`.
  virtual void createUnits(StageOp stage, mlir::IntegerAttr source);
  /// Where a unit leaves what the kernel's stage emits, or what the other does.
  virtual mlir::Value createWriter(mlir::Location at,
                                   mlir::FlatSymbolRefAttr other);
  mlir::Value constant(int64_t value) {
    return mlir::arith::ConstantIndexOp::create(rewriter, loc, value);
  }

  mlir::Location loc;
  mlir::Operation *work;
  mlir::IRRewriter rewriter;
  mlir::Value bins, unit;
  mlir::Operation *unitEnd = nullptr;

private:
  void createWriters();
  void convertSource(ItemsOp items);
  void convertBins(BinsOp over);
  /// A loop over the unit's buckets, or its calls.
  mlir::scf::ForOp createUnitLoop();
  void passOverEmptyBins(BucketRangeOp range, mlir::scf::ForOp loop);
  /// Where what follows the last batch of a bin goes.
  mlir::Block *createBinEnd(mlir::Value call, mlir::Value bin);
  /// Makes a loop over primitives of work on them, or takes one list.
  void convertItems(ItemsOp items, mlir::Value from, mlir::Value begin,
                    mlir::Value end, mlir::Value writer);
  void convertList(ListsOp lists, mlir::Value from, mlir::Value call,
                   mlir::Value writer);
  void convertLocal(WorkOpInterface local);
  /// What a piece of work emits goes to a writer.
  void convertEmissions(WorkOpInterface piece, mlir::Value writer);
  void convertPlaces(mlir::Value prim, mlir::Value writer,
                     mlir::IntegerAttr port);

  mlir::Value unitsEnd;
  llvm::DenseMap<mlir::Attribute, mlir::Value> writers; ///< By stage.
};

} // namespace piko

#endif // PIKO_TRANSFORMS_STORAGE_UNITFORMER_H
