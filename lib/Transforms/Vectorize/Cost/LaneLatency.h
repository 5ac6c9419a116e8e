// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops whose iterations wait for the iteration before.

#ifndef PIKO_LIB_TRANSFORMS_LANELATENCY_H
#define PIKO_LIB_TRANSFORMS_LANELATENCY_H

#include "Vectorize/Analysis/IterationLanes.h"

namespace piko {

/// Whether twice as many lanes, as two vectors whose instructions take turns,
/// are expected to take much less: loops inside are bound by the latency of
/// what they hand on, and registers hold that of both vectors.
bool isBoundByLatency(const IterationLanes &lanes);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANELATENCY_H
