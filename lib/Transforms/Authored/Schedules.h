// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_TRANSFORMS_SCHEDULES_H
#define PIKO_LIB_TRANSFORMS_SCHEDULES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// Whether a schedule says more than which core takes a bin.
inline bool saysMoreThanCore(ScheduleOp schedule) {
  auto said =
      llvm::cast<mlir::DictionaryAttr>(schedule->getPropertiesAsAttribute());
  return llvm::any_of(said, [&](mlir::NamedAttribute directive) {
    return directive.getName() != schedule.getKindAttrName() &&
           directive.getName() != schedule.getTileSplitAttrName() &&
           directive.getName() != schedule.getResolvedAttrName();
  });
}

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SCHEDULES_H
