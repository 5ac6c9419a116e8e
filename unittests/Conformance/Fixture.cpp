//===- Fixture.cpp - Pipelines and what they are fed ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Fixture.h"

#include <algorithm>
#include <numeric>

namespace conformance {

Dots makeDots(size_t count, unsigned seed) {
  std::minstd_rand random(seed);
  Dots dots(count);
  for (Dot &d : dots)
    d = {int32_t(random() % width), int32_t(random() % height),
         int32_t(random() % 1000)};
  return dots;
}

Walkers makeWalkers(size_t count, int hops, unsigned seed) {
  std::minstd_rand random(seed);
  Walkers walkers(count);
  for (Walker &w : walkers)
    w = {int32_t(random() % width), int32_t(random() % height),
         int32_t(random() % 1000), int32_t(random() % unsigned(hops + 1))};
  return walkers;
}

Items makeItems(size_t count, unsigned seed) {
  std::minstd_rand random(seed);
  std::vector<int32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0);
  std::shuffle(indices.begin(), indices.end(), random);
  Items items;
  for (int32_t index : indices) {
    auto position = [&](int extent) {
      return float(int(random() % unsigned(8 * (extent + 10)))) / 8 - 5;
    };
    items.push_back({index, position(width), position(height),
                     float(random() % 500), int32_t(random() % 16)});
  }
  return items;
}

Pipeline make(const pikort_program &program) {
  Pipeline pipe(program);
  EXPECT_TRUE(pipe.created()) << pipe.created().message();
  EXPECT_TRUE(pipe.domain({width, height}));
  return pipe;
}

Pipeline makeTraced(const pikort_program &program) {
  Pipeline pipe = make(program);
  EXPECT_TRUE(pipe.constant("bias", int32_t(bias)));
  return pipe;
}

void expectError(const Status &status, int32_t code,
                 std::initializer_list<const char *> parts) {
  EXPECT_EQ(status.code(), code) << status.message();
  for (const char *part : parts)
    EXPECT_NE(status.message().find(part), std::string::npos)
        << status.message() << "\nhas no " << part;
}

} // namespace conformance
