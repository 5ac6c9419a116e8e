// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaProgramTest.cpp - Programs as tables of steps ------------------===//

#include "cuda/CudaFixture.h"

using namespace piko::cuda;
using piko::rt::Pipeline;
using piko::rt::Status;

namespace {

/// Scales by a table that a test makes up.
class CudaProgram : public Cuda {
protected:
  static Status create(std::vector<pikoir_cuda_step> table) {
    steps = std::move(table);
    return Pipeline{program}.created();
  }
  static void expectRefused(std::vector<pikoir_cuda_step> table,
                            const char *text) {
    Status status = create(std::move(table));
    EXPECT_EQ(status.code(), PIKORT_BAD_PROGRAM);
    expectIn(status, {"pipeline 'Scale': ", text});
  }
  static pikoir_cuda_step step(int32_t kind, int32_t number) {
    return {kind, number, -1, -1, nullptr, nullptr};
  }
  /// The stage's kernel.
  static pikoir_cuda_step stage(int32_t number = 0) {
    return {PIKOIR_STEP_STAGE, number, -1, -1, grids, nullptr};
  }

  static inline pikoir_cuda_grid grids[2];
  static inline std::vector<pikoir_cuda_step> steps;

private:
  static void setup(pikort_pipeline *p) {
    grids[0] = {kernel, 32, 4, writeArguments};
    ScaleProgram::program.setup(p);
    int32_t stages[] = {0};
    pikoir_declare_strips(p, 0, 0, 0, stages, 1);
    pikoir_cuda_program(p, steps.data(), static_cast<int64_t>(steps.size()));
  }
  static void setupWithoutDevice(pikort_pipeline *p) {
    pikoir_cuda_program(p, steps.data(), 0);
  }
  static int32_t run(pikort_pipeline *p) {
    int32_t status = 0;
    while (pikoir_strips_next(p, 0))
      status = ScaleProgram::program.run(p);
    return status ? status : pikoir_status(p);
  }

protected:
  static constexpr pikort_program program{PIKORT_ABI_VERSION, "Scale", setup,
                                          run};
  static constexpr pikort_program withoutDevice{PIKORT_ABI_VERSION, "Scale",
                                                setupWithoutDevice, run};
};

TEST_F(CudaProgram, NumbersOfNothingAreRefused) {
  expectRefused({stage(1)}, "did not expect step 0 of its program, of kind 2 "
                            "and number 1");
  expectRefused({stage(-1)}, "number -1");
  expectRefused({stage(), step(PIKOIR_STEP_CLEAR, 2)}, "step 1 of its program");
  expectRefused({step(PIKOIR_STEP_SOURCE, 0)}, "of kind 1 and number 0");
  expectRefused({step(PIKOIR_STEP_QUEUE, 0)}, "of kind 3");
  expectRefused({step(PIKOIR_STEP_WAVES, 0)}, "of kind 6");
  expectRefused({step(99, 0)}, "of kind 99");
}

TEST_F(CudaProgram, WhatIsRepeatedEnds) {
  auto begin = step(PIKOIR_STEP_STRIPS, 0),
       end = step(PIKOIR_STEP_END_STRIPS, 0);
  expectRefused({begin, stage()},
                "expected an end of what step 0 of its program begins");
  expectRefused({stage(), end}, "did not expect step 1");
  expectRefused({begin, stage(), end, end}, "did not expect step 3");
  EXPECT_TRUE(create({begin, stage(), end}));
}

TEST_F(CudaProgram, NeedsADevice) {
  steps = {stage()};
  Status status = Pipeline{withoutDevice}.created();
  EXPECT_EQ(status.code(), PIKORT_BAD_PROGRAM);
  expectIn(status, {"expected pikoir_cuda_module before "
                    "pikoir_cuda_program"});
}

// The host waits for each grid.
TEST_F(CudaProgram, WithoutStepsTheHostLeads) {
  for (bool hasSteps : {true, false}) {
    pikoTestDriverReset();
    steps = hasSteps ? std::vector{step(PIKOIR_STEP_STRIPS, 0), stage(),
                                   step(PIKOIR_STEP_END_STRIPS, 0)}
                     : std::vector<pikoir_cuda_step>();
    Pipeline pipe{program};
    ASSERT_TRUE(pipe.created());
    std::fill(out.begin(), out.end(), -1);
    ASSERT_TRUE(bind(pipe));
    ASSERT_TRUE(pipe.run());
    expectScaled();
    PikoTestDriverCounts counts;
    pikoTestDriverCounts("piko_join", &counts);
    EXPECT_EQ(counts.launches, hasSteps ? 1u : 0u);
  }
}

} // namespace
