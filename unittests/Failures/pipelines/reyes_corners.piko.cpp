// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Patches that are larger on the screen than their corners tell.
#include "uniform_reyes.h"

struct CornerReyes : uniform::UniformReyes<uniform::CornerSplit> {};
