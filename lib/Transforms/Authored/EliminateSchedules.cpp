// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-eliminate-schedules: erases schedules that say no more than load
// balancing, which a stage without a schedule has, too.

#include "Authored/Schedules.h"

#include "Piko/Transforms/Passes.h"

namespace piko {
#define GEN_PASS_DEF_ELIMINATESCHEDULES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct EliminateSchedulesPass
    : piko::impl::EliminateSchedulesBase<EliminateSchedulesPass> {
  void runOnOperation() override;
};
} // namespace

void EliminateSchedulesPass::runOnOperation() {
  for (auto stage : getOperation().getOps<StageOp>()) {
    ScheduleOp schedule = stage.getSchedule();
    if (!schedule || schedule.getKind() != ScheduleKind::LoadBalance ||
        !schedule.getBody().empty())
      continue;
    if (saysMoreThanCore(schedule))
      schedule.setResolved(true);
    else
      schedule.erase();
  }
}
