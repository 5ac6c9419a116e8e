// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is counted, as calls of the runtime.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Dialect/Piko/IR/PikoCount.h"

using namespace mlir;
using namespace piko;

// What is counted is the runtime's by number.
static_assert(int(CounterKind::Calls) == PIKORT_CALLS &&
              int(CounterKind::Iterations) == PIKORT_ITERATIONS &&
              int(CounterKind::Trips) == PIKORT_TRIPS &&
              int(CounterKind::Emissions) == PIKORT_EMISSIONS &&
              int(CounterKind::Reads) == PIKORT_READS &&
              int(CounterKind::Stores) == PIKORT_STORES &&
              int(CounterKind::Updates) == PIKORT_UPDATES &&
              int(CounterKind::Atomics) == PIKORT_ATOMICS &&
              int(CounterKind::Floats) == PIKORT_FLOATS &&
              int(CounterKind::Integers) == PIKORT_INTEGERS &&
              int(CounterKind::Effects) == PIKORT_EFFECTS &&
              int(CounterKind::Scalars) == PIKORT_SCALARS &&
              int(CounterKind::Vectors) == PIKORT_VECTORS &&
              int(CounterKind::Lanes) == PIKORT_LANES &&
              int(CounterKind::ActiveLanes) == PIKORT_ACTIVE_LANES);

namespace {

struct CountLowering : ContextPattern<CountOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(CountOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_count),
                 {context.frame(op), createI32(rewriter, loc, op.getNumber()),
                  toI64(rewriter, loc, adaptor.getAmount())});
    rewriter.eraseOp(op);
    return success();
  }
};

struct CountElementLowering : ContextPattern<CountElementOp> {
  using ContextPattern::ContextPattern;
  LogicalResult
  matchAndRewrite(CountElementOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    SmallVector<Value> arguments{context.frame(op),
                                 createI32(rewriter, loc, op.getNumber())};
    ValueRange indices = adaptor.getIndices();
    for (size_t dim = 0; dim < 4; ++dim)
      arguments.push_back(dim < indices.size()
                              ? toI64(rewriter, loc, indices[dim])
                              : createI64(rewriter, loc, 0));
    arguments.push_back(createI64(rewriter, loc, op.getBytes()));
    arguments.push_back(createI64(rewriter, loc, op.getOffset()));
    context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_count_element),
                 arguments);
    rewriter.eraseOp(op);
    return success();
  }
};

} // namespace

void piko::populateCountsToLLVMPatterns(const TypeConverter &converter,
                                        RewritePatternSet &patterns,
                                        LoweringContext &context) {
  patterns.add<CountLowering, CountElementLowering>(
      converter, patterns.getContext(), context);
}
