// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaProgramTest.cpp - Programs as tables of steps ------------------===//

#include "cuda/CudaFixture.h"

#include <utility>

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

  void SetUp() override {
    Cuda::SetUp();
    grid = {kernel, 32, 4, writeArguments};
  }

  static inline pikoir_cuda_grid grid, grids[2];
  static inline std::vector<pikoir_cuda_step> steps;

private:
  static void setup(pikort_pipeline *p) {
    grids[0] = grid;
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
  expectRefused({begin, begin, stage(), end, end}, "did not expect step 1");
  EXPECT_TRUE(create({begin, stage(), end}));
}

TEST_F(CudaProgram, NeedsADevice) {
  steps = {stage()};
  Status status = Pipeline{withoutDevice}.created();
  EXPECT_EQ(status.code(), PIKORT_BAD_PROGRAM);
  expectIn(status, {"expected pikoir_cuda_module before "
                    "pikoir_cuda_program"});
}

TEST_F(CudaProgram, GridsThatCannotBeLaunchedAreRefused) {
  steps = {stage()};
  for (pikoir_cuda_grid wrong :
       {pikoir_cuda_grid{kernel, 0, 4, writeArguments},
        pikoir_cuda_grid{kernel, 1025, 4, writeArguments},
        pikoir_cuda_grid{kernel, 32, -1, writeArguments},
        pikoir_cuda_grid{kernel, 32, 513, writeArguments},
        pikoir_cuda_grid{kernel, 32, 4, nullptr}}) {
    grid = wrong;
    expectRefused(steps, "step 0 of its program: expected grid 'scale' to have "
                         "1 to 1024 threads a block");
  }
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

// --- Loops -------------------------------------------------------------------

/// Two stages that give each other primitives, and two that get what leaves.
/// Nothing runs.
class CudaLoop : public Cuda {
protected:
  void SetUp() override {
    Cuda::SetUp();
    isOrdered = false;
    table = {step(PIKOIR_STEP_WAVES, 0),
             step(PIKOIR_STEP_ENTRY, 0, /*member=*/0),
             step(PIKOIR_STEP_EXIT, 2, -1, /*exit=*/0),
             step(PIKOIR_STEP_EXIT, 4, -1, /*exit=*/1),
             stage(0),
             step(PIKOIR_STEP_QUEUE, 0, /*member=*/1),
             step(PIKOIR_STEP_QUEUE, 2, -1, /*exit=*/0),
             stage(1),
             step(PIKOIR_STEP_QUEUE, 1, /*member=*/0),
             step(PIKOIR_STEP_QUEUE, 3, -1, /*exit=*/0),
             step(PIKOIR_STEP_QUEUE, 4, -1, /*exit=*/1),
             step(PIKOIR_STEP_END_WAVES, 0),
             stage(2),
             stage(3)};
  }
  static Status create() { return Pipeline{program}.created(); }
  static void expectRefused(const std::string &text) {
    Status status = create();
    EXPECT_EQ(status.code(), PIKORT_BAD_PROGRAM) << text;
    expectIn(status, {"pipeline 'Walk': ", text.c_str()});
  }
  static pikoir_cuda_step step(int32_t kind, int32_t number,
                               int32_t member = -1, int32_t exit = -1) {
    return {kind, number, member, exit, nullptr, nullptr};
  }
  static pikoir_cuda_step stage(int32_t number) {
    return {PIKOIR_STEP_STAGE, number, -1, -1, grids, nullptr};
  }

  static inline pikoir_cuda_grid grids[2] = {{"scale", 32, 4, writeArguments}};
  static inline std::vector<pikoir_cuda_step> table;
  static inline bool isOrdered = false; ///< One position at a time.

private:
  static void setup(pikort_pipeline *p) {
    pikoir_cuda_module(p, images.data());
    pikoir_cuda_program(p, table.data(), static_cast<int64_t>(table.size()));
    pikoir_declare_pipeline(p, "Walk", 1);
    pikoir_declare_record(p, 0, "int", 4, 4);
    pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
    int64_t bins[] = {0};
    const char *names[] = {"walk", "turn", "draw", "count"};
    for (int32_t s = 0; s < 4; ++s)
      pikoir_declare_stage(p, s, names[s], 0, bins, PIKOIR_LOAD_BALANCE, 0,
                           isOrdered && s == 0 ? PIKOIR_ORDERED : 0, 0);
    pikoir_declare_source(p, 0, 0);
    const int32_t edges[][3] = {
        {0, 0, 1}, {1, 0, 0}, {0, 1, 2}, {1, 1, 2}, {1, 2, 3}};
    for (auto [producer, port, consumer] : edges)
      pikoir_declare_edge(p, producer, port, consumer);
    const int32_t stages[] = {0, 1};
    pikoir_declare_cycle(p, 0, stages, 2);
    pikoir_declare_loop(p, 0, stages, 2, 0);
  }
  static int32_t run(pikort_pipeline *p) { return pikoir_status(p); }
  static constexpr pikort_program program{PIKORT_ABI_VERSION, "Walk", setup,
                                          run};
};

TEST_F(CudaLoop, MembersAndExitsAreThoseOfTheLoop) {
  for (bool isSeen : {false, true}) {
    isOrdered = isSeen;
    ASSERT_TRUE(create());
    for (size_t at = 0; at < table.size(); ++at)
      for (int32_t pikoir_cuda_step::*part :
           {&pikoir_cuda_step::member, &pikoir_cuda_step::exit})
        for (int32_t wrong : {INT32_MIN, -2, -1, 0, 1, 2, 3, INT32_MAX}) {
          int32_t right = table[at].*part;
          if (wrong == right)
            continue;
          table[at].*part = wrong;
          expectRefused("step " + std::to_string(at) + " of its program, of ");
          expectRefused("but got " + std::to_string(wrong));
          table[at].*part = right;
        }
  }
}

TEST_F(CudaLoop, NumbersOfNothingAreRefused) {
  for (size_t at = 0; at < table.size(); ++at)
    for (int32_t wrong : {INT32_MIN, -1, 5, INT32_MAX}) {
      int32_t right = std::exchange(table[at].number, wrong);
      expectRefused("did not expect step " + std::to_string(at));
      table[at].number = right;
    }
}

TEST_F(CudaLoop, StepsAreWhereTheyBelong) {
  auto expectWith = [](size_t at, pikoir_cuda_step wrong) {
    std::swap(table[at], wrong);
    expectRefused("did not expect step " + std::to_string(at));
    std::swap(table[at], wrong);
  };
  // Another stage's edge, one that does not leave, and one to a stage that has
  // an exit already.
  expectWith(6, step(PIKOIR_STEP_QUEUE, 3, -1, 0));
  expectWith(2, step(PIKOIR_STEP_EXIT, 0, -1, 0));
  expectWith(3, step(PIKOIR_STEP_EXIT, 3, -1, 1));
  // A stage of the loop outside of it, and another one in it.
  expectWith(12, stage(0));
  expectWith(4, stage(2));
  expectWith(1, step(PIKOIR_STEP_ENTRY, 2, 0));
  expectWith(1, step(PIKOIR_STEP_WAVES, 0));
  expectWith(12, step(PIKOIR_STEP_ENTRY, 0, 0));
  expectWith(12, step(PIKOIR_STEP_EXIT, 2, -1, 0));
  expectWith(12, step(PIKOIR_STEP_QUEUE, 0, 1));
  table.erase(table.begin() + 3);
  expectRefused("step 9 of its program: expected an exit of loop 0 to stage "
                "'count'");
}

TEST_F(CudaLoop, OfOnePositionAtATimeAllIsThere) {
  isOrdered = true;
  std::vector<pikoir_cuda_step> whole = table;
  table.erase(table.begin() + 1);
  expectRefused("expected an entry of what step 0 of its program begins");
  table = whole;
  table.erase(table.begin() + 7, table.begin() + 11);
  expectRefused("expected the stages of what step 0 of its program begins in "
                "the order of their declaration, each once");
}

} // namespace
