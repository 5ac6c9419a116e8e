// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- VersionsTest.cpp - The choice between codes for processors ---------===//

#include "pikort/abi.h"

#include <cstdlib>
#include <gtest/gtest.h>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr const char *nameVariable = "PIKO_CPU";

int32_t ran = 0; ///< The version that ran last.

template <int Number> int32_t run(pikort_pipeline *) {
  ran = Number;
  return PIKORT_OK;
}
int32_t runProgram(pikort_pipeline *) {
  ADD_FAILURE() << "expected a version to run, but got the program";
  return PIKORT_OK;
}

void declare(pikort_pipeline *p) { pikoir_declare_pipeline(p, "Chosen", 1); }

const pikoir_version every{"every", "", declare, run<1>};
const pikoir_version second{"second", "", declare, run<2>};
const pikoir_version never{"never", "nonsense,folly", declare, run<3>};
const pikoir_version nothing{"nothing", "whim", declare, run<4>};

std::vector<pikoir_version> versions;

void setup(pikort_pipeline *p) {
  pikoir_setup_version(p, versions.data(),
                       static_cast<int32_t>(versions.size()));
}

/// What is created where a program has these versions: the name of the chosen
/// processor, which runs, or what is wrong.
std::string create(const std::vector<pikoir_version> &list,
                   int32_t status = PIKORT_OK) {
  versions = list;
  pikort_program program{PIKORT_ABI_VERSION, "Chosen", setup, runProgram};
  pikort_pipeline *p = nullptr;
  EXPECT_EQ(pikort_create(&program, &p), status);
  std::string said = status ? pikort_message(p) : pikort_processor(p);
  if (status == PIKORT_OK) {
    int64_t extent = 1;
    EXPECT_EQ(pikort_set_domain(p, 1, &extent), PIKORT_OK);
    EXPECT_EQ(pikort_run(p), PIKORT_OK) << pikort_message(p);
  }
  pikort_destroy(p);
  return said;
}

class Versions : public testing::Test {
protected:
  void SetUp() override { unsetenv(nameVariable); }
  void TearDown() override { unsetenv(nameVariable); }
};

} // namespace

TEST_F(Versions, TakesTheLastThatFits) {
  EXPECT_EQ(create({every}), "every");
  EXPECT_EQ(ran, 1);
  EXPECT_EQ(create({every, second}), "second");
  EXPECT_EQ(ran, 2);
  EXPECT_EQ(create({every, second, never}), "second");
  EXPECT_EQ(ran, 2);
  EXPECT_EQ(create({never, every}), "every");
  EXPECT_EQ(ran, 1);
}

TEST_F(Versions, SaysWhatTheProcessorLacks) {
  EXPECT_EQ(create({never}, PIKORT_WRONG_PROCESSOR),
            "pipeline 'Chosen': expected a processor that runs code for never, "
            "but this one lacks nonsense, folly");
  EXPECT_EQ(create({nothing, never}, PIKORT_WRONG_PROCESSOR),
            "pipeline 'Chosen': expected a processor that runs code for "
            "nothing or never, but this one lacks whim (nothing) and nonsense, "
            "folly (never)");
  EXPECT_EQ(create({}, PIKORT_BAD_PROGRAM),
            "pipeline 'Chosen': expected code for some processor");
}

TEST_F(Versions, VariableNamesAnother) {
  setenv(nameVariable, "every", 1);
  EXPECT_EQ(create({every, second}), "every");
  EXPECT_EQ(ran, 1);
  EXPECT_EQ(create({second}), "second"); // there is nothing to choose
  setenv(nameVariable, "", 1);
  EXPECT_EQ(create({every, second}), "second");
  setenv(nameVariable, "never", 1);
  EXPECT_EQ(create({every, never}, PIKORT_WRONG_PROCESSOR),
            "pipeline 'Chosen': expected a processor that runs code for never, "
            "but this one lacks nonsense, folly");
  setenv(nameVariable, "third", 1);
  EXPECT_EQ(create({every, second}, PIKORT_NOT_FOUND),
            "pipeline 'Chosen': PIKO_CPU: expected every or second, but got "
            "'third'");
}

#if defined(__x86_64__)
/// The runtime finds what the compiler that built this test may use, and what
/// it says of the processor.
TEST_F(Versions, KnowsTheProcessor) {
  struct Feature {
    const char *name;
    bool isThere;
  };
  const Feature features[] = {
      {"sse4.2", __builtin_cpu_supports("sse4.2") != 0},
      {"popcnt", __builtin_cpu_supports("popcnt") != 0},
      {"avx", __builtin_cpu_supports("avx") != 0},
      {"avx2", __builtin_cpu_supports("avx2") != 0},
      {"fma", __builtin_cpu_supports("fma") != 0},
      {"bmi", __builtin_cpu_supports("bmi") != 0},
      {"bmi2", __builtin_cpu_supports("bmi2") != 0},
      {"xop", __builtin_cpu_supports("xop") != 0},
      {"fma4", __builtin_cpu_supports("fma4") != 0},
      {"gfni", __builtin_cpu_supports("gfni") != 0},
      {"avx512f", __builtin_cpu_supports("avx512f") != 0},
      {"avx512bw", __builtin_cpu_supports("avx512bw") != 0},
      {"avx512vl", __builtin_cpu_supports("avx512vl") != 0},
      {"avx512vbmi2", __builtin_cpu_supports("avx512vbmi2") != 0},
      {"avx512bf16", __builtin_cpu_supports("avx512bf16") != 0},
      {"avx512vpopcntdq", __builtin_cpu_supports("avx512vpopcntdq") != 0},
  };
  for (const Feature &feature : features) {
    pikoir_version version{"some", feature.name, declare, run<5>};
    EXPECT_EQ(create({every, version}), feature.isThere ? "some" : "every")
        << feature.name;
  }
}
#endif

TEST_F(Versions, PipelinesAreCreatedByManyThreads) {
  versions = {every, second, never};
  pikort_program program{PIKORT_ABI_VERSION, "Chosen", setup, runProgram};
  std::vector<std::string> chosen(8);
  std::vector<std::thread> threads;
  for (std::string &name : chosen)
    threads.emplace_back([&] {
      pikort_pipeline *p = nullptr;
      if (pikort_create(&program, &p) == PIKORT_OK)
        name = pikort_processor(p);
      pikort_destroy(p);
    });
  for (std::thread &thread : threads)
    thread.join();
  EXPECT_EQ(chosen, std::vector<std::string>(8, "second"));
}
