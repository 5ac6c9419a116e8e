// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates whose pixels follow from data: two iterations of a parallel loop may
// update one pixel, and then in their order. Grouped by pixel, threads can
// share them.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_GROUPUPDATES_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_GROUPUPDATES_H

#include "PikoToGPU/Mapping/WorkLegality.h"

namespace piko {

/// Why the updates of a loop's iterations cannot be grouped, if they cannot.
std::optional<Obstacle> findObstacleToGrouping(ParallelLoopOpInterface loop);

/// Makes a piko.grouped of each update of the loop. What stands around it in
/// branches is cut in two (loop fission): what precedes the update, and what
/// follows it.
void groupUpdates(ParallelLoopOpInterface loop);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_GROUPUPDATES_H
