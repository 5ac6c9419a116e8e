//===- EqualDepth.cpp - The first among equals ----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Failure.h"

#include "KeyedSheets.h"
#include "PrepassSheets.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>

namespace failures {
namespace {

constexpr int size = 128;

/// What each pixel shows; -1 for nothing.
using Shown = std::vector<int>;

/// Overlapping rectangles at two depths.
template <class Sheet> std::vector<Sheet> makeSheets(int count) {
  std::minstd_rand random(count);
  std::uniform_int_distribution<int> place(-32, size - 1), extent(24, 64);
  std::vector<Sheet> sheets;
  for (int i = 0; i < count; ++i) {
    glm::ivec2 at{place(random), place(random)};
    glm::ivec2 end = at + glm::ivec2{extent(random), extent(random)};
    sheets.push_back({glm::max(at, 0), glm::min(end, size - 1),
                      i % 3 == 0 ? 3.0f : 2.0f, i});
  }
  return sheets;
}

Shown drawPrepass(int count) {
  pipelines::PrepassSheets pipe;
  auto sheets = makeSheets<pipelines::PrepassSheets::Sheet>(count);
  pipe.setDomain({size, size});
  pipe.setThreads(4);
  pipe.feed(0, sheets);
  pipe.feed(1, sheets);
  pipe.run().orThrow();
  auto image = pipe.state().shown.view();
  Shown shown;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      shown.push_back(image(x, y) - 1);
  return shown;
}

Shown drawKeyed(int count, int threads) {
  pipelines::KeyedSheets pipe;
  auto sheets = makeSheets<pipelines::KeyedSheets::Sheet>(count);
  pipe.setDomain({size, size});
  pipe.setThreads(threads);
  pipe.feed(0, sheets);
  pipe.run().orThrow();
  auto image = pipe.state().keys.view();
  Shown shown;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      shown.push_back(image(x, y) ? int(~uint32_t(image(x, y))) : -1);
  return shown;
}

Shown findExact(int count) {
  auto sheets = makeSheets<pipelines::KeyedSheets::Sheet>(count);
  std::sort(sheets.begin(), sheets.end(), [](auto &a, auto &b) {
    return std::pair(a.depth, a.index) < std::pair(b.depth, b.index);
  });
  Shown shown;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      auto first = std::find_if(sheets.begin(), sheets.end(), [&](auto &s) {
        return x >= s.lo.x && x <= s.hi.x && y >= s.lo.y && y <= s.hi.y;
      });
      shown.push_back(first == sheets.end() ? -1 : first->index);
    }
  return shown;
}

double percentWrong(const Shown &shown, const Shown &exact) {
  double wrong = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    wrong += shown[i] != exact[i];
  return 100 * wrong / double(exact.size());
}

Image show(const Shown &shown) {
  return paint(size, size, [&](int x, int y) {
    int i = shown[y * size + x];
    return i < 0 ? rgb(0, 0, 0)
                 : rgb(0.2f + 0.8f * float(i * 37 % 64) / 64,
                       0.2f + 0.8f * float(i * 23 % 64) / 64,
                       0.2f + 0.8f * float(i * 51 % 64) / 64);
  });
}

struct EqualDepth : Mode {
  Description describe() const override {
    return {"EqualDepth",
            "Sheets at equal depths, of which the first is seen",
            "sheets",
            "percent of pixels that show another one",
            "stores where the depth is equal",
            "keys of depth and number",
            {2, 5, 10, 20, 50, 100, 300}};
  }
  Errors measure(double count) const override {
    Shown exact = findExact(int(count));
    return {percentWrong(drawPrepass(int(count)), exact),
            percentWrong(drawKeyed(int(count), 4), exact)};
  }
  Pictures draw() const override {
    return {show(drawPrepass(60)), show(drawKeyed(60, 4))};
  }
};
const Registration<EqualDepth> registration;

TEST(Failure, EqualDepth) {
  for (int count : {20, 300}) {
    Errors errors = EqualDepth().measure(count);
    EXPECT_GT(errors.naive, 10) << count;
    EXPECT_EQ(errors.ours, 0) << count;
    EXPECT_EQ(drawKeyed(count, 1), drawKeyed(count, 3)) << count;
  }
}

} // namespace
} // namespace failures
