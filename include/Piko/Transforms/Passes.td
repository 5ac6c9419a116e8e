// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that stay inside the `piko` dialect: from the authored level to
// kernels and on to loops over storage.

#ifndef PIKO_TRANSFORMS_PASSES_TD
#define PIKO_TRANSFORMS_PASSES_TD

include "Piko/Transforms/InstrumentationPasses.td"
include "Piko/Transforms/SpecializationPasses.td"
include "Piko/Transforms/AuthoredPasses.td"
include "Piko/Transforms/KernelPasses.td"
include "Piko/Transforms/MachinePasses.td"
include "Piko/Transforms/RankPasses.td"
include "Piko/Transforms/CPUPasses.td"
include "Piko/Transforms/VectorPasses.td"

#endif // PIKO_TRANSFORMS_PASSES_TD
