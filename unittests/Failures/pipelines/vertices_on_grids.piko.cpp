// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Vertices on grids, so that edges run exactly through pixel centres. Float
// edges are exact on these scenes: only the fill rule counts.
#include "counted_draws.h"

struct ClosedTriangles : CountedDraws<FloatEdges<true>> {};
struct OpenTriangles : CountedDraws<FloatEdges<false>> {};
struct FillRuleTriangles : CountedDraws<ExactEdges> {};
