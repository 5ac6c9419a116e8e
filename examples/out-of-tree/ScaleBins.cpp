// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// **Requires** the authored level, at which bins are attributes of stages
// alone: phases ask which bin a position is in.
//
// **Does** multiply each side of the stages' bins by `factor`; 0, which stands
// for the whole domain, stays.
//
// **Guarantees** the same pixels: the size of bins changes only how they are
// made.

#include "ScaleBins.h"

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/Pass/Pass.h"

using namespace mlir;

namespace {

struct ScaleBins : PassWrapper<ScaleBins, OperationPass<ModuleOp>> {
  MLIR_DEFINE_EXPLICIT_INTERNAL_INLINE_TYPE_ID(ScaleBins)

  ScaleBins() = default;
  ScaleBins(const ScaleBins &other) : PassWrapper(other) {}

  StringRef getArgument() const override { return "scale-bins"; }
  StringRef getDescription() const override {
    return "make the bins of all stages larger";
  }

  void runOnOperation() override {
    if (factor < 1 || factor > 64) {
      getOperation().emitError()
          << "scale-bins: expected a factor from 1 to 64, but got "
          << factor.getValue();
      return signalPassFailure();
    }
    getOperation().walk([&](piko::StageOp stage) {
      SmallVector<int64_t> bins(stage.getBins());
      for (int64_t &side : bins)
        side *= factor;
      stage.setBins(bins);
      ++scaled;
    });
  }

  Option<int64_t> factor{*this, "factor",
                         llvm::cl::desc("of each side, from 1 to 64 (2)"),
                         llvm::cl::init(2)};
  Statistic scaled{this, "scaled", "stages whose bins are larger"};
};

} // namespace

void registerScaleBins() { PassRegistration<ScaleBins>(); }
