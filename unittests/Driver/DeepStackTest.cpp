// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Driver/DeepStack.h"

#include "llvm/Support/ErrorHandling.h"

#include <gtest/gtest.h>
#include <thread>
#include <vector>

using namespace piko;

namespace {

/// Stack that a small thread has not.
int recurse(int depth) {
  volatile char bytes[1024] = {};
  return depth == 0 ? bytes[0] : recurse(depth - 1) + 1;
}

TEST(Contained, RunsOnADeepStack) {
  int reached = 0;
  EXPECT_EQ(runContained([&] { reached = recurse(40000); }), std::nullopt);
  EXPECT_EQ(reached, 40000);
}

TEST(Contained, FatalErrorsAreReasons) {
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(runContained([] { llvm::report_fatal_error("no such thing"); }),
              "the compiler failed: no such thing");
}

TEST(Contained, SeveralAtOnce) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([i] {
      std::string text = "number " + std::to_string(i);
      for (int k = 0; k < 20; ++k) {
        EXPECT_EQ(runContained([&] { llvm::report_fatal_error(text.c_str()); }),
                  "the compiler failed: " + text);
        EXPECT_EQ(runContained([] {}), std::nullopt);
      }
    });
  for (std::thread &thread : threads)
    thread.join();
}

TEST(ContainedDeathTest, OthersFatalErrorsEndTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(
      runContained([] {
        std::thread([] { llvm::report_fatal_error("of the host's"); }).join();
      }),
      "LLVM ERROR: of the host's");
  EXPECT_DEATH(llvm::report_fatal_error("afterwards"),
               "LLVM ERROR: afterwards");
}

} // namespace
