//===- MeshFuzzTest.cpp - Mutated files are read or refused ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "MeshFuzz.h"

#include <cstdlib>
#include <gtest/gtest.h>

namespace {

/// PIKO_FUZZ_FILES=N reads so many, as CONTRIBUTING.md says.
TEST(MeshFuzz, MutatedFilesAreReadOrRefused) {
  const char *asked = std::getenv("PIKO_FUZZ_FILES");
  uint64_t count = asked ? std::strtoull(asked, nullptr, 10) : 20000;
  EXPECT_EQ(fuzzReaders(1, count), "");
}

} // namespace
