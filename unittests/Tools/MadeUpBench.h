//===- MadeUpBench.h - Settings with made-up times --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_TOOLS_MADEUPBENCH_H
#define PIKO_UNITTESTS_TOOLS_MADEUPBENCH_H

#include "Search.h"

#include <cmath>
#include <random>
#include <set>

namespace piko::tune {

/// Times that a function says, with noise: each is up to some percent more, one
/// in twenty twice as much, and the machine gets slower and faster.
class MadeUpBench : public Bench {
public:
  MadeUpBench(std::function<double(const Setting &)> cost, double noise,
              unsigned seed)
      : cost(std::move(cost)), noise(noise), random(seed) {}

  render::Result<uint64_t> prepare(const Setting &setting) override {
    if (broken.contains(setting))
      return render::Error{"does not compile"};
    uint64_t program = 0;
    for (int value : setting)
      program = program * 16 + uint64_t(value);
    return program;
  }
  render::Result<double> visit(const Setting &setting) override {
    ++visits;
    std::uniform_real_distribution<double> uniform(0, 1);
    double drift = 1 + 0.3 * std::sin(0.02 * visits);
    double spike = uniform(random) < 0.05 ? 1 : 0;
    return cost(setting) * drift *
           (1 + noise * uniform(random) + (noise > 0 ? spike : 0));
  }
  render::Result<double> measureError(const Setting &setting) override {
    return errorOf(setting);
  }
  void release(const Setting &) override {}

  std::set<Setting> broken;
  std::function<double(const Setting &)> errorOf = [](const Setting &) {
    return 0.0;
  };
  int visits = 0;

private:
  std::function<double(const Setting &)> cost;
  double noise;
  std::mt19937 random;
};

} // namespace piko::tune

#endif // PIKO_UNITTESTS_TOOLS_MADEUPBENCH_H
