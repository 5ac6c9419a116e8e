// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Vectorize/Analysis/Lanes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

VectorType piko::getVectorType(Type type, int64_t laneCount) {
  if (isa<PrimType>(type))
    type = IndexType::get(type.getContext());
  return VectorType::get({laneCount}, type);
}

bool piko::isOverPrimitives(scf::ForOp loop) {
  return loop->hasAttr(marks::lanes) &&
         loop->getParentOfType<scf::ForallOp>() && getKernelStage(loop) &&
         !loop.getNumResults() && matchPattern(loop.getStep(), m_One()) &&
         !loop.getBody()->getOps<ItemOp>().empty();
}

StringRef piko::getLoopPhase(scf::ForOp loop) {
  for (ItemOp item : loop.getBody()->getOps<ItemOp>())
    if (auto bins = item.getBins().getDefiningOp<OpenBinsOp>())
      return bins.getSource() ? "assignBin" : "process";
  return "process";
}

std::optional<LaneMapping> piko::getLaneMapping(scf::ForOp loop) {
  auto mapping = loop->getAttrOfType<LaneMappingAttr>(marks::mapping);
  return mapping ? std::optional(mapping.getValue()) : std::nullopt;
}

bool piko::isOverBox(scf::ForOp loop) {
  Value lower = loop.getLowerBound();
  while (auto cast = lower.getDefiningOp<arith::IndexCastOp>())
    lower = cast.getIn();
  return lower.getDefiningOp<arith::MaxSIOp>() != nullptr;
}

bool piko::hasSpecifiedLanes(scf::ForOp loop, LaneMapping lanes) {
  StageOp stage = getKernelStage(loop);
  ScheduleOp schedule = stage ? stage.getSchedule() : ScheduleOp();
  return schedule && schedule.getLanes() == lanes;
}
