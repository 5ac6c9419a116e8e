// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_TRANSFORMS_SCHEDULES_H
#define PIKO_LIB_TRANSFORMS_SCHEDULES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether a schedule says more than which core takes a bin.
inline bool saysMoreThanCore(ScheduleOp schedule) {
  return schedule.getEndStageAttr() || schedule.getEndBin() ||
         schedule.getAfter() || schedule.getBatch() || schedule.getEveryBin() ||
         schedule.getUnordered() || schedule.getLanes();
}

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SCHEDULES_H
