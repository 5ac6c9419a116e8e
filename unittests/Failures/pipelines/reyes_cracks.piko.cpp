// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Patches that share borders. `OwnRateReyes` dices each piece by its own rate;
// in the example, what a border is diced into depends on the border alone.
#include "uniform_reyes.h"

struct OwnRateReyes : uniform::UniformReyes<reyes::Split> {};
struct ExampleReyes : reyes::MappedReyes<{.bin = 32, .rest = piko::DirectMap}> {
};
