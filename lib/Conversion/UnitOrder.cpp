// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What units of work a kernel of the machine level has, and who takes them.

#include "Piko/Conversion/UnitOrder.h"

using namespace mlir;
using namespace piko;

Operation *piko::findWork(KernelOp kernel) {
  for (Operation &op : *kernel.getBodyBlock())
    if (isa<BinsOp, ItemsOp>(op))
      return &op;
  return nullptr;
}

FlatSymbolRefAttr piko::getStageName(Operation *work) {
  if (auto bins = dyn_cast<BinsOp>(work))
    return bins.getStageAttr();
  return cast<WorkOpInterface>(work).getStageAttr();
}

std::optional<UnitOrder> piko::getUnitOrder(KernelOp kernel) {
  Operation *work = findWork(kernel);
  if (!work)
    return std::nullopt;
  // The counters are for the launches of the kernel itself.
  if (kernel.getPrecedes())
    return UnitOrder::Fixed;
  // A source's primitives are in no bins yet, and its units have as many each.
  if (isa<ItemsOp>(work))
    return UnitOrder::Fixed;
  auto stage = lookupInPipeline<StageOp>(kernel, getStageName(work));
  ScheduleOp schedule = stage.getSchedule();
  if (!schedule)
    return UnitOrder::Dispatched;
  // One that depends on the bin has units of all kinds.
  if (!schedule.getBody().empty())
    return UnitOrder::Dispatched;
  if (!schedule.getResolved())
    return UnitOrder::Taken;
  ScheduleKind kind = schedule.getKind();
  return kind == ScheduleKind::DirectMap || kind == ScheduleKind::Serialize
             ? UnitOrder::Fixed
             : UnitOrder::Dispatched;
}
