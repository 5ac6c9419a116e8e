// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/Expectations.h"

#include "Piko/Analysis/BranchProbability.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

std::optional<int64_t> piko::getConstantIterations(scf::ForOp loop) {
  if (std::optional<APInt> count = loop.getStaticTripCount())
    return count->getLimitedValue();
  auto strip = [](Value value) {
    while (auto cast = value.getDefiningOp<arith::IndexCastOp>())
      value = cast.getIn();
    return value;
  };
  auto sum = strip(loop.getUpperBound()).getDefiningOp<arith::AddIOp>();
  if (!sum || !matchPattern(loop.getStep(), m_One()) ||
      strip(sum.getLhs()) != strip(loop.getLowerBound()))
    return std::nullopt;
  return getConstantIntValue(sum.getRhs());
}

std::optional<double> piko::getExpectedIterations(Operation *loop) {
  if (auto counted = dyn_cast<scf::ForOp>(loop))
    if (std::optional<int64_t> count = getConstantIterations(counted))
      return double(*count);
  return getProbableIterations(loop);
}

bool piko::doesNextToNothing(Region &side) {
  return side.empty() || countOperations(side) <= expected::fewOperations;
}

bool piko::isMuchLonger(Region &side, Region &other) {
  return !doesNextToNothing(other) &&
         countOperations(side) > expected::rareToUsual * countOperations(other);
}
