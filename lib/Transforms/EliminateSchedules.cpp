// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-eliminate-schedules: what the loop over bins does by itself is said no
// longer.

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

/// Whether any core may take the next bin at any time, which needs no word.
static bool saysNothing(ScheduleOp schedule) {
  return schedule.getKind() == ScheduleKind::LoadBalance &&
         schedule.getBody().empty() && !schedule.getEndStageAttr() &&
         !schedule.getEndBin() && !schedule.getBatch() &&
         !schedule.getEveryBin() && !schedule.getUnordered();
}

void EliminateSchedulesPass::runOnOperation() {
  for (auto stage : getOperation().getOps<StageOp>())
    if (ScheduleOp schedule = stage.getSchedule();
        schedule && saysNothing(schedule)) {
      schedule.erase();
      ++eliminated;
    }
}
