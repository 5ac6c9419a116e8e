//===- Progress.h - How far some work has got -------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_COMMANDLINE_PROGRESS_H
#define PIKO_COMMANDLINE_PROGRESS_H

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace piko {

/// Shows a line on standard error while some work lasts, if that is a terminal
/// and the work takes longer than two seconds ($PIKO_PROGRESS_AFTER: another
/// number of them; with 0 each change is shown at once). The line is wiped at
/// the end.
class Progress {
public:
  /// What is done, as in "compiling a.piko.cpp".
  explicit Progress(std::string label);
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;
  ~Progress();

  /// The part that is done, from 0 to 1.
  void update(double part);
  /// Prints a line on standard error, which stays, a terminal or not.
  void say(const std::string &line);

private:
  using Clock = std::chrono::steady_clock;
  void watch();
  void draw(); ///< Under the mutex.
  void wipe(); ///< Likewise.

  const std::string label;
  const std::chrono::duration<double> after;
  const bool isTerminal;
  const Clock::time_point start = Clock::now();
  std::mutex mutex;
  std::condition_variable ended;
  double done = -1; ///< Unknown if below 0.
  bool isShown = false, hasEnded = false;
  std::thread watcher;
};

} // namespace piko

#endif // PIKO_COMMANDLINE_PROGRESS_H
