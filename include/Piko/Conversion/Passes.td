// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Passes that take kernels to upstream dialects, and grids of them.

#ifndef PIKO_CONVERSION_PASSES_TD
#define PIKO_CONVERSION_PASSES_TD

include "Piko/Conversion/GPUPasses.td"
include "Piko/Conversion/TargetPasses.td"

#endif // PIKO_CONVERSION_PASSES_TD
