//===- ProgressBar.h - A bar on the terminal --------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_SCENE_PROGRESSBAR_H
#define PIKO_SCENE_PROGRESSBAR_H

#include <chrono>
#include <string>

namespace piko::render {

/// Shows on standard error how far some work has got, if that is a terminal
/// and the work takes longer than half a second. The line is wiped at the end.
class ProgressBar {
public:
  explicit ProgressBar(std::string label);
  ProgressBar(const ProgressBar &) = delete;
  ProgressBar &operator=(const ProgressBar &) = delete;
  ~ProgressBar();

  /// The part that is done, from 0 to 1.
  void update(double part);

private:
  using Clock = std::chrono::steady_clock;
  std::string label;
  bool isTerminal, isShown = false;
  Clock::time_point start = Clock::now(), drawn = start;
};

} // namespace piko::render

#endif // PIKO_SCENE_PROGRESSBAR_H
