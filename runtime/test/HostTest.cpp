// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- HostTest.cpp - The host API, its errors, and state -----------------===//

#include "piko/markers.h"
#include "pikort/abi.h"
#include "pikort/pikort.hpp"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <string>
#include <vector>

// The language and the runtime are apart, but mean the same bin.
static_assert(piko::marker::nanPosition == PIKOIR_NAN_BOX);

namespace {

struct Pixel {
  float z;
  int32_t id;
};

/// What the kernel of the test program does.
enum class Act {
  Nothing,
  BadBin,
  NegativeBin,
  BadClear,
  Fail,
  Status,
  SkipSource,
  Interrupt
};
Act act = Act::Nothing;

// A source of Pixel that stage "bin" places in 4x4 bins of an 8x8 domain.
void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Small", 2);
  pikoir_declare_record(p, 0, "Pixel", sizeof(Pixel), 4);
  pikoir_declare_field(p, 0, "z", PIKORT_F32, 0, 1, 0);
  pikoir_declare_field(p, 0, "id", PIKORT_I32, 4, 1, 0);
  Pixel clear{1.0f, -1};
  pikoir_declare_state(p, 0, "scale", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "lights", PIKORT_BUFFER, 0, 1, -1, nullptr);
  pikoir_declare_state(p, 2, "shaded", PIKORT_BUFFER, 0, 1, 0, nullptr);
  pikoir_declare_state(p, 3, "depth", PIKORT_IMAGE, 0, 2, -1, &clear);
  pikoir_declare_state(p, 4, "bias", PIKORT_CONSTANT, 0, 0, -1, &clear);
  int64_t bins[] = {4, 4};
  pikoir_declare_stage(p, 0, "bin", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_PLACED, 2);
  pikoir_declare_source(p, 0, 0);
}

int32_t run(pikort_pipeline *p) {
  if (act == Act::Status)
    return 99;
  if (act == Act::BadClear) {
    pikoir_clear(p, 1);
    return pikoir_status(p);
  }
  pikoir_clear(p, 2);
  pikoir_clear(p, 3);
  if (act != Act::SkipSource) {
    const pikoir_input *in = pikoir_begin_source(p, 0);
    if (!in)
      return pikoir_status(p);
#pragma omp parallel for num_threads(pikoir_threads(p))
    for (int64_t u = 0; u < in->unit_count; ++u) {
      pikoir_writer *w = pikoir_open_source(p, 0, u);
      for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
        int64_t bad = act == Act::BadBin        ? 16 + i * 4
                      : act == Act::NegativeBin ? -4 + i % 4
                                                : i % 16;
        pikoir_place_source(w, i < 5 ? 0 : bad);
        pikoir_next(w);
      }
      pikoir_close(w);
    }
    if (act == Act::Interrupt)
      pikort_interrupt(p, 1);
    if (int32_t status = pikoir_end_source(p, 0))
      return status;
  }
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  auto *depth = reinterpret_cast<Pixel *>(pikoir_get_state(p, 3)->data);
  auto *shaded = reinterpret_cast<Pixel *>(pikoir_get_state(p, 2)->data);
  for (int64_t i = 0; i < in->count; ++i) {
    int64_t item = in->order ? in->order[i] : i;
    auto *pixel = reinterpret_cast<const Pixel *>(in->items) + item;
    depth[pixel->id % 64].z += 1;
    shaded[item].id += 7;
  }
  if (act == Act::Fail)
    for (int64_t y : {9, 5, 7})
      pikoir_fail(p, 0, nullptr, -1, PIKORT_UPDATE_OUTSIDE, 3 + (y << 32), 0);
  return pikoir_end(p, 0);
}

const pikort_program program{PIKORT_ABI_VERSION, "Small", setup, run};

class Host : public testing::Test {
protected:
  void SetUp() override {
    act = Act::Nothing;
    ASSERT_TRUE(pipe.created()) << pipe.created().message();
    points.resize(100);
    for (int i = 0; i < 100; ++i)
      points[static_cast<size_t>(i)] = {0, i};
  }
  void bindAll() {
    ASSERT_TRUE(pipe.domain({8, 8}));
    ASSERT_TRUE(pipe.constant("scale", Pixel{2, 0}));
    ASSERT_TRUE(pipe.allocate("lights", 3));
    ASSERT_TRUE(pipe.source(0, points));
  }
  void expectError(const piko::rt::Status &status, int32_t code,
                   const std::string &text) {
    EXPECT_EQ(status.code(), code);
    EXPECT_EQ(status.message(), text);
  }
  piko::rt::Pipeline pipe{program};
  std::vector<Pixel> points;
};

TEST_F(Host, RunsAndReadsBack) {
  bindAll();
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(pipe.run());
    auto depth = pipe.view<Pixel>("depth");
    ASSERT_EQ(depth.elements.size(), 64u);
    EXPECT_EQ(depth.extent[1], 8);
    // Cleared at each run: 100 points on 64 pixels.
    EXPECT_EQ(depth(0).z, 3.0f);
    EXPECT_EQ(depth(7, 7).z, 2.0f);
    EXPECT_EQ(depth(0).id, -1);
    auto shaded = pipe.view<Pixel>("shaded");
    ASSERT_EQ(shaded.elements.size(), 100u);
    EXPECT_EQ(shaded(99).id, 7);
  }
  ASSERT_TRUE(pipe.domain({5, 3}));
  ASSERT_TRUE(pipe.view<Pixel>("bias").elements.data());
}

// There is nothing to wait for.
TEST_F(Host, RunsOnTheProcessorAtOnce) {
  bindAll();
  ASSERT_TRUE(pipe.runAsync());
  EXPECT_TRUE(pipe.isDone());
  EXPECT_EQ(pipe.view<Pixel>("depth")(0).z, 3.0f);
  ASSERT_TRUE(pipe.wait());
  act = Act::BadBin;
  EXPECT_EQ(pipe.runAsync().code(), PIKORT_BIN_OUTSIDE);
  EXPECT_TRUE(pipe.wait());
  act = Act::Nothing;
  expectError(pipe.runAsync(piko::rt::Stream(nullptr)), PIKORT_INVALID_ARGUMENT,
              "pipeline 'Small': expected a run without a stream, because the "
              "pipeline is on the processor");
  ASSERT_TRUE(pipe.run());
}

TEST_F(Host, MemoryOfADeviceOnTheProcessor) {
  bindAll();
  piko::rt::DeviceSpan<Pixel> far(uint64_t(0x7000'0000'0000), 4);
  expectError(pipe.source(0, far), PIKORT_INVALID_ARGUMENT,
              "source 0: expected memory of the host, because the pipeline is "
              "on the processor, but got memory of a device");
  expectError(pipe.buffer("lights", far), PIKORT_INVALID_ARGUMENT,
              "buffer 'lights': expected memory of the host, because the "
              "pipeline is on the processor, but got memory of a device");
  ASSERT_TRUE(pipe.run());
  EXPECT_TRUE(pipe.deviceView<Pixel>("depth").empty());
  EXPECT_STREQ(
      pikort_message(pipe.get()),
      "state 'depth': expected a pipeline on a device, but this one is "
      "on the processor");
  std::vector<Pixel> copy(64);
  ASSERT_TRUE(pipe.read("depth", std::span(copy)));
  EXPECT_EQ(copy[0].z, 3.0f);
}

TEST_F(Host, FollowsTheDomain) {
  bindAll();
  points.resize(10);
  ASSERT_TRUE(pipe.source(0, points));
  for (int64_t side : {8, 1000, 9}) {
    ASSERT_TRUE(pipe.domain({side, side}));
    ASSERT_TRUE(pipe.run());
    auto depth = pipe.view<Pixel>("depth");
    ASSERT_EQ(depth.elements.size(), static_cast<size_t>(side * side));
    EXPECT_EQ(depth(side - 1, side - 1).z, 1.0f);
  }
}

TEST_F(Host, Unbound) {
  expectError(pipe.run(), PIKORT_UNBOUND,
              "pipeline 'Small': the domain is not set");
  ASSERT_TRUE(pipe.domain({8, 8}));
  expectError(pipe.run(), PIKORT_UNBOUND,
              "pipeline 'Small': constant 'scale' is not bound");
  ASSERT_TRUE(pipe.constant("scale", Pixel{}));
  expectError(pipe.run(), PIKORT_UNBOUND,
              "pipeline 'Small': buffer 'lights' is not bound");
  ASSERT_TRUE(pipe.buffer("lights", points));
  pikort_view view;
  EXPECT_EQ(pikort_get_view(pipe.get(), "depth", &view), PIKORT_UNBOUND);
  EXPECT_STREQ(pikort_message(pipe.get()),
               "state 'depth' exists only after a run");
  // A source that is not bound has no primitives.
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(pipe.view<Pixel>("depth")(7, 7).z, 1.0f);
  ASSERT_EQ(pikort_get_view(pipe.get(), "scale", &view), PIKORT_OK);
  EXPECT_EQ(static_cast<const Pixel *>(view.data)->z, 0.0f);
  ASSERT_TRUE(pipe.source(0, points));
  EXPECT_TRUE(pipe.run());
  EXPECT_STREQ(pikort_message(pipe.get()), "");
}

TEST_F(Host, WrongNamesAndSizes) {
  expectError(pipe.constant("sclae", Pixel{}), PIKORT_NOT_FOUND,
              "pipeline 'Small' has no state 'sclae'");
  expectError(pipe.constant("scale", 1.0f), PIKORT_SIZE_MISMATCH,
              "constant 'scale': expected 8 bytes for a 'Pixel', but got 4");
  expectError(pipe.constant("lights", Pixel{}), PIKORT_INVALID_ARGUMENT,
              "state 'lights': expected a constant, but it is a buffer");
  expectError(pipe.allocate("shaded", 4), PIKORT_INVALID_ARGUMENT,
              "buffer 'shaded' is allocated for source 0 and cannot be bound");
  expectError(pipe.allocate("lights", -4), PIKORT_INVALID_ARGUMENT,
              "buffer 'lights': expected a count of at least 0, but got -4");
  EXPECT_EQ(pipe.allocate("lights", INT64_MAX).code(), PIKORT_OUT_OF_MEMORY);
  EXPECT_EQ(pipe.allocate("lights", INT64_MAX / 8).code(),
            PIKORT_OUT_OF_MEMORY);
  expectError(pipe.source(1, points), PIKORT_NOT_FOUND,
              "pipeline 'Small' has no source 1");
  EXPECT_EQ(
      pikort_bind_source(pipe.get(), 0, points.data(), int64_t(1) << 32, 8),
      PIKORT_TOO_MANY);
  EXPECT_STREQ(pikort_message(pipe.get()),
               "source 0: expected at most 4294967295 primitives, but got "
               "4294967296");
  EXPECT_EQ(pikort_bind_source(pipe.get(), 0, nullptr, 1, 8),
            PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(pikort_bind_source(pipe.get(), 0,
                               reinterpret_cast<char *>(points.data()) + 1, 1,
                               8),
            PIKORT_INVALID_ARGUMENT);
  EXPECT_STREQ(pikort_message(pipe.get()),
               "source 0: expected a pointer aligned to 4 bytes");
}

TEST_F(Host, BadDomains) {
  for (int64_t extent :
       {int64_t(0), int64_t(-3), int64_t(PIKORT_MAX_EXTENT) + 1})
    expectError(pipe.domain({extent, 8}), PIKORT_INVALID_ARGUMENT,
                "pipeline 'Small': expected domain extents in [1, 1073741824], "
                "but got " +
                    std::to_string(extent) + " in dimension 0");
  expectError(pipe.domain({8}), PIKORT_INVALID_ARGUMENT,
              "pipeline 'Small': expected a domain of rank 2, but got 1");
  bindAll();
  ASSERT_TRUE(pipe.domain({PIKORT_MAX_EXTENT, PIKORT_MAX_EXTENT}));
  expectError(pipe.run(), PIKORT_TOO_MANY,
              "stage 'bin': expected fewer than 2147483647 buckets, but the "
              "domain has more");
  // Few enough buckets, but an image that no machine holds.
  ASSERT_TRUE(pipe.memoryLimit(1 << 20));
  ASSERT_TRUE(pipe.domain({60000, 60000}));
  expectError(pipe.run(), PIKORT_OUT_OF_MEMORY,
              "state 'depth': out of memory: expected 30064771072 more bytes, "
              "but the limit is 1048576");
  ASSERT_TRUE(pipe.domain({8, 8}));
  EXPECT_TRUE(pipe.run());
}

TEST(Domains, LargerThanDeclared) {
  auto setup = [](pikort_pipeline *p) {
    pikoir_declare_pipeline(p, "Small", 2);
    pikoir_declare_max_extent(p, 100);
  };
  piko::rt::Pipeline pipe({PIKORT_ABI_VERSION, "Small", setup,
                           [](pikort_pipeline *) { return 0; }});
  ASSERT_TRUE(pipe.created());
  ASSERT_TRUE(pipe.domain({8, 101}));
  piko::rt::Status status = pipe.run();
  EXPECT_EQ(status.code(), PIKORT_INVALID_ARGUMENT);
  EXPECT_EQ(status.message(),
            "pipeline 'Small': expected at most 100 cells in each dimension "
            "where positions are floats, but the domain has 101");
  ASSERT_TRUE(pipe.domain({8, 100}));
  EXPECT_TRUE(pipe.run());
}

// An image is refused before the system has to give it.
TEST(Images, LargerThanMemory) {
  auto setup = [](pikort_pipeline *p) {
    pikoir_declare_pipeline(p, "Huge", 2);
    pikoir_declare_record(p, 0, "Pixel", sizeof(Pixel), 4);
    pikoir_declare_state(p, 0, "color", PIKORT_IMAGE, 0, 2, -1, nullptr);
  };
  piko::rt::Pipeline pipe(
      {PIKORT_ABI_VERSION, "Huge", setup, [](pikort_pipeline *) { return 0; }});
  ASSERT_TRUE(pipe.created());
  auto expect = [&](int64_t side, const char *text) {
    ASSERT_TRUE(pipe.domain({side, side}));
    piko::rt::Status status = pipe.run();
    EXPECT_EQ(status.code(), PIKORT_OUT_OF_MEMORY);
    EXPECT_EQ(status.message(), text);
  };
  expect(PIKORT_MAX_EXTENT, "state 'color': out of memory");
  expect(1 << 22, "state 'color': out of memory: expected 140737488355328 more "
                  "bytes");
  ASSERT_TRUE(pipe.memoryLimit(1 << 30));
  expect(100000, "state 'color': out of memory: expected 85899345920 more "
                 "bytes, but the limit is 1073741824");
  ASSERT_TRUE(pipe.domain({1, 1}));
  EXPECT_TRUE(pipe.run());
}

TEST_F(Host, BadThreads) {
  for (int threads : {-1, 10001})
    expectError(pipe.threads(threads), PIKORT_INVALID_ARGUMENT,
                "expected a number of threads in [0, 10000], but got " +
                    std::to_string(threads));
  bindAll();
  // Ten thousand take the system eight seconds.
  int most = std::getenv("PIKO_TEST_ALL") ? 10000 : 300;
  for (int threads : {0, 1, 100, most}) {
    ASSERT_TRUE(pipe.threads(threads));
    EXPECT_TRUE(pipe.run());
  }
  EXPECT_TRUE(pipe.threads(10000));
}

TEST_F(Host, LoopLimit) {
  expectError(pipe.loopLimit(-1), PIKORT_INVALID_ARGUMENT,
              "expected a loop limit of at least 0, but got -1");
  EXPECT_EQ(pikoir_loop_limit(pipe.get()), 1 << 20);
  EXPECT_TRUE(pipe.loopLimit(0));
  EXPECT_EQ(pikoir_loop_limit(pipe.get()), 0);
}

// The first error in item order is reported, whatever the threads.
TEST_F(Host, BinsOutsideTheGrid) {
  bindAll();
  for (int threads : {1, 7}) {
    ASSERT_TRUE(pipe.threads(threads));
    act = Act::BadBin;
    expectError(pipe.run(), PIKORT_BIN_OUTSIDE,
                "stage 'bin': expected a bin id in [0, 4), but got "
                "9");
    act = Act::NegativeBin;
    expectError(pipe.run(), PIKORT_BIN_OUTSIDE,
                "stage 'bin': expected a bin id in [0, 4), but got "
                "-1, which binFromPosition gives outside of the domain");
  }
  act = Act::Nothing;
  EXPECT_TRUE(pipe.run());
}

TEST_F(Host, ErrorsOfGeneratedCode) {
  bindAll();
  act = Act::Fail;
  expectError(pipe.run(), PIKORT_UPDATE_OUTSIDE,
              "stage 'bin': expected an update inside the stage's own bin, but "
              "got pixel (3, 5)");
  act = Act::Status;
  expectError(pipe.run(), PIKORT_BAD_PROGRAM,
              "pipeline 'Small': the program returned status 99");
  act = Act::BadClear;
  expectError(pipe.run(), PIKORT_BAD_PROGRAM,
              "expected an image, or a buffer that is sized by a source, to "
              "clear, but got state 1");
  act = Act::SkipSource;
  expectError(pipe.run(), PIKORT_BAD_PROGRAM,
              "stage 'bin': expected the bins of source 0 to be assigned "
              "before");
}

TEST_F(Host, Interrupted) {
  bindAll();
  pikort_interrupt(nullptr, 1);
  act = Act::Interrupt; // after the first kernel
  expectError(pipe.run(), PIKORT_INTERRUPTED,
              "pipeline 'Small': interrupted before stage 'bin'");
  act = Act::Nothing;
  EXPECT_EQ(pipe.run().code(), PIKORT_INTERRUPTED);
  pikort_interrupt(pipe.get(), 0);
  EXPECT_TRUE(pipe.run());
  EXPECT_EQ(pipe.view<Pixel>("depth")(0).z, 3.0f);
}

TEST_F(Host, Reflection) {
  pikort_pipeline *p = pipe.get();
  EXPECT_STREQ(pikort_name(p), "Small");
  EXPECT_EQ(pikort_rank(p), 2);
  EXPECT_EQ(pikort_record_count(p), 1);
  EXPECT_EQ(pikort_state_count(p), 5);
  EXPECT_EQ(pikort_stage_count(p), 1);
  EXPECT_EQ(pikort_source_count(p), 1);
  pikort_record_info record;
  ASSERT_EQ(pikort_get_record(p, 0, &record), PIKORT_OK);
  EXPECT_EQ(record.field_count, 2);
  pikort_field_info field;
  ASSERT_EQ(pikort_get_field(p, 0, 1, &field), PIKORT_OK);
  EXPECT_STREQ(field.name, "id");
  EXPECT_EQ(field.type, PIKORT_I32);
  EXPECT_EQ(pikort_get_field(p, 1, 1, &field), PIKORT_NOT_FOUND);
  pikort_state_info state;
  ASSERT_EQ(pikort_get_state_info(p, 2, &state), PIKORT_OK);
  EXPECT_STREQ(state.name, "shaded");
  EXPECT_EQ(state.per_source, 0);
  EXPECT_EQ(state.bound, 1);
  pikort_stage_info stage;
  ASSERT_EQ(pikort_get_stage_info(p, 0, &stage), PIKORT_OK);
  EXPECT_EQ(stage.bin_size[1], 4);
  EXPECT_EQ(stage.port_count, 0);
  EXPECT_EQ(pikort_get_stage_info(p, 1, &stage), PIKORT_NOT_FOUND);
  EXPECT_EQ(pikort_get_stage_info(p, 0, nullptr), PIKORT_INVALID_ARGUMENT);
  pikort_source_info source;
  ASSERT_EQ(pikort_get_source_info(p, 0, &source), PIKORT_OK);
  EXPECT_EQ(source.count, 0);
}

// The parts of a run's time sum to what the host sees of it.
TEST_F(Host, TimeStatistics) {
  bindAll();
  pikort_pipeline *p = pipe.get();
  auto start = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - start <
         std::chrono::milliseconds(200))
    ASSERT_TRUE(pipe.run());
  double seen = std::chrono::duration<double, std::milli>(
                    std::chrono::steady_clock::now() - start)
                    .count();
  pikort_time_stats time;
  ASSERT_EQ(pikort_get_time_stats(p, &time), PIKORT_OK);
  double sum = 0;
  for (double part :
       {time.device, time.kernels, time.waiting, time.joins, time.cycles,
        time.clears, time.allocation, time.program}) {
    EXPECT_GE(part, 0);
    sum += part;
  }
  EXPECT_LE(sum, 1.02 * seen);
  EXPECT_GE(sum, 0.5 * seen); // short runs: the host's own time counts
  EXPECT_EQ(time.cycles, 0);
  pikort_reset_stats(p);
  ASSERT_EQ(pikort_get_time_stats(p, &time), PIKORT_OK);
  EXPECT_EQ(time.kernels + time.joins + time.program, 0);
  EXPECT_EQ(pikort_get_time_stats(p, nullptr), PIKORT_INVALID_ARGUMENT);
}

TEST_F(Host, Statistics) {
  bindAll();
  for (int frame = 0; frame < 3; ++frame)
    ASSERT_TRUE(pipe.run());
  pikort_pipeline *p = pipe.get();
  EXPECT_EQ(pikort_stats_runs(p), 3);
  ASSERT_EQ(pikort_kernel_count(p), 2);
  pikort_kernel_stats kernel;
  ASSERT_EQ(pikort_get_kernel_stats(p, 0, &kernel), PIKORT_OK);
  EXPECT_STREQ(kernel.name, "bin.assign0");
  EXPECT_EQ(kernel.launches, 3);
  EXPECT_GT(kernel.milliseconds, 0);
  ASSERT_EQ(pikort_get_kernel_stats(p, 1, &kernel), PIKORT_OK);
  EXPECT_STREQ(kernel.name, "bin");
  EXPECT_GE(kernel.milliseconds, kernel.join_milliseconds);
  pikort_stage_stats stage;
  ASSERT_EQ(pikort_get_stage_stats(p, 0, &stage), PIKORT_OK);
  EXPECT_EQ(stage.in, 300);
  EXPECT_EQ(stage.placed, 300);
  EXPECT_GT(pikort_peak_bytes(p), 0);
  pikort_reset_stats(p);
  EXPECT_EQ(pikort_stats_runs(p), 0);
  ASSERT_EQ(pikort_get_stage_stats(p, 0, &stage), PIKORT_OK);
  EXPECT_EQ(stage.in, 0);
}

TEST(Create, RejectsBadPrograms) {
  pikort_pipeline *p = nullptr;
  EXPECT_EQ(pikort_create(nullptr, &p), PIKORT_INVALID_ARGUMENT);
  auto expect = [&](pikort_program bad, int32_t code, const char *text) {
    EXPECT_EQ(pikort_create(&bad, &p), code);
    EXPECT_STREQ(pikort_message(p), text);
    EXPECT_EQ(pikort_run(p), PIKORT_BAD_PROGRAM);
    pikort_destroy(p);
  };
  constexpr uint32_t version = PIKORT_ABI_VERSION;
  expect({version + 1, "Newer", setup, run}, PIKORT_VERSION,
         ("pipeline 'Newer': expected a program for runtime version " +
          std::to_string(version) + ", but got " + std::to_string(version + 1))
             .c_str());
  expect({PIKORT_ABI_VERSION, "Empty", nullptr, run}, PIKORT_BAD_PROGRAM,
         "pipeline 'Empty': expected a program with setup and run");
  auto twice = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_record(p, 0, "Pixel", 8, 4);
  };
  expect({PIKORT_ABI_VERSION, "Twice", twice, run}, PIKORT_BAD_PROGRAM,
         "expected record 0 to be declared once");
  auto field = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_field(p, 0, "w", PIKORT_F64, 4, 1, 0);
  };
  expect({PIKORT_ABI_VERSION, "Field", field, run}, PIKORT_BAD_PROGRAM,
         "record 'Pixel': expected field 'w' inside 8 bytes, but got offset 8");
  auto tiles = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_stage(p, 1, "list", 0, nullptr, 0, 0, PIKOIR_LIST, 2);
  };
  expect({PIKORT_ABI_VERSION, "Tiles", tiles, run}, PIKORT_BAD_PROGRAM,
         "stage 'list': a process that takes a list has no owner tiles");
  auto batch = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_schedule(p, 0, 8, 0);
  };
  expect({PIKORT_ABI_VERSION, "Batch", batch, run}, PIKORT_BAD_PROGRAM,
         "stage 'bin': a batch needs a process that takes a list");
  auto negative = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_schedule(p, 0, -8, 0);
  };
  expect({PIKORT_ABI_VERSION, "Negative", negative, run}, PIKORT_BAD_PROGRAM,
         "stage 'bin': expected a batch of at least 1, but got -8");
  auto wait = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_wait(p, 0, 3);
  };
  expect({PIKORT_ABI_VERSION, "Wait", wait, run}, PIKORT_BAD_PROGRAM,
         "pipeline 'Small': expected a declared stage to wait for, but got 3");
  auto noSource = [](pikort_pipeline *p) {
    setup(p);
    int32_t stages[] = {0};
    pikoir_declare_strips(p, 0, 1, 0, stages, 1);
  };
  expect({PIKORT_ABI_VERSION, "NoSource", noSource, run}, PIKORT_BAD_PROGRAM,
         "strips: expected a declared source, but got 1");
  auto twoGroups = [](pikort_pipeline *p) {
    setup(p);
    int32_t stages[] = {0};
    pikoir_declare_strips(p, 0, 0, 0, stages, 1);
    pikoir_declare_strips(p, 1, 0, 0, stages, 1);
  };
  expect({PIKORT_ABI_VERSION, "TwoGroups", twoGroups, run}, PIKORT_BAD_PROGRAM,
         "strips: expected a declared stage of one group, but got 0");
  auto noPort = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_join(p, 0, 3, PIKOIR_CONCATENATE, 0);
  };
  expect({PIKORT_ABI_VERSION, "NoPort", noPort, run}, PIKORT_BAD_PROGRAM,
         "pipeline 'Small': expected the port of an edge");
  auto keys = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_keys(p, 0, -1);
  };
  auto twoOfLoop = [](pikort_pipeline *p) {
    setup(p);
    pikoir_declare_stage(p, 1, "other", 0, nullptr, 0, 0, 0, 0);
    int32_t stages[] = {0, 1};
    pikoir_declare_cycle(p, 0, stages, 1);
    pikoir_declare_cycle(p, 1, stages + 1, 1);
    pikoir_declare_loop(p, 0, stages, 2, 0);
  };
  expect({PIKORT_ABI_VERSION, "TwoOfLoop", twoOfLoop, run}, PIKORT_BAD_PROGRAM,
         "stage 'other': expected its loop to be part of one cycle");
  expect({PIKORT_ABI_VERSION, "Keys", keys, run}, PIKORT_BAD_PROGRAM,
         "stage 0: expected keys of at least 0 words, but got -1");
  auto twoCycles = [](pikort_pipeline *p) {
    setup(p);
    int32_t stages[] = {0};
    pikoir_declare_cycle(p, 0, stages, 1);
    pikoir_declare_cycle(p, 1, stages, 1);
  };
  expect(
      {PIKORT_ABI_VERSION, "TwoCycles", twoCycles, run}, PIKORT_BAD_PROGRAM,
      "pipeline 'Small': expected a declared stage of one cycle or loop, but "
      "got 0");
  auto noCycle = [](pikort_pipeline *p) {
    setup(p);
    int32_t stages[] = {0};
    pikoir_declare_loop(p, 0, stages, 1, 0);
  };
  expect(
      {PIKORT_ABI_VERSION, "NoCycle", noCycle, run}, PIKORT_BAD_PROGRAM,
      "pipeline 'Small': expected a declared stage of one cycle or loop, but "
      "got 0");
  pikort_destroy(nullptr);
}

TEST(HostView, HasFourDimensions) {
  std::vector<int> pixels(2 * 3 * 4 * 5);
  for (size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<int>(i);
  piko::rt::View<int> view{pixels, {2, 3, 4, 5}};
  int next = 0;
  for (int w = 0; w < 5; ++w)
    for (int z = 0; z < 4; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 2; ++x)
          EXPECT_EQ(view(x, y, z, w), next++);
}

} // namespace
