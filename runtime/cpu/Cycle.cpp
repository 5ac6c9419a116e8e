// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Cycle.cpp - Runs the stages of a cycle until nothing is left -------===//

#include "cpu/Kernel.h"

using namespace piko::rt;

extern "C" {

int32_t pikoir_cycle_step(pikort_pipeline *p, int32_t stage) {
  guarded(p, "run", [&] {
    throw Failure{PIKORT_BAD_PROGRAM,
                  "expected a stage of a cycle, but got stage " +
                      std::to_string(stage)};
  });
  return -1;
}

int64_t pikoir_loop_limit(pikort_pipeline *p) { return p->loopLimit; }

int64_t pikoir_begin_schedule(pikort_pipeline *p, int32_t stage) {
  const int64_t *grid = pikoir_grid(p, stage);
  return grid[0] * grid[1] * grid[2] * grid[3];
}

void pikoir_schedule_bin(pikort_pipeline *, int32_t, int64_t, int32_t, int64_t,
                         int64_t, int32_t) {}

void pikoir_defer_begin(pikoir_writer *, int64_t) {}
void pikoir_defer_iteration(pikoir_writer *, int64_t) {}
void pikoir_defer_end(pikoir_writer *) {}

void *pikoir_scratch(pikoir_writer *, int64_t) { return nullptr; }
int64_t pikoir_scratch_mark(pikoir_writer *) { return 0; }
void pikoir_scratch_release(pikoir_writer *, int64_t) {}

} // extern "C"
