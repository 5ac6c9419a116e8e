// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What units of work a kernel of the machine level has, and who takes them.

#include "Piko/Conversion/UnitOrder.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

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

namespace {
/// Whose bins a kernel's units are of, and whether they are primitives of a
/// source, which are in no bins yet.
struct UnitSource {
  FlatSymbolRefAttr stage;
  bool isSource;
};
} // namespace

static std::optional<UnitSource> findUnits(KernelOp kernel) {
  for (auto bins : kernel.getOps<OpenBinsOp>())
    return UnitSource{bins.getStageAttr(), bins.getSource().has_value()};
  if (Operation *work = findWork(kernel))
    return UnitSource{getStageName(work), isa<ItemsOp>(work)};
  return std::nullopt;
}

std::optional<UnitOrder> piko::getUnitOrder(KernelOp kernel) {
  std::optional<UnitSource> units = findUnits(kernel);
  if (!units)
    return std::nullopt;
  // The counters are for the launches of the kernel itself. The units of a
  // source have as many primitives each.
  if (kernel.getPrecedes() || units->isSource)
    return UnitOrder::Fixed;
  auto stage = lookupInPipeline<StageOp>(kernel, units->stage);
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
