// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Triangles that share edges anywhere, drawn by float and by exact edge
// functions.
#include "counted_draws.h"

struct NaiveSharedEdges : CountedDraws<FloatEdges<true>> {};
struct ExactSharedEdges : CountedDraws<ExactEdges> {};
