//===- Progress.cpp - How far some work has got ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/Progress.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <unistd.h>

using namespace piko;
using namespace std::chrono_literals;

/// Of $PIKO_PROGRESS_AFTER; two seconds if it is no number.
static std::chrono::duration<double> readThreshold() {
  double seconds = 2;
  if (const char *set = std::getenv("PIKO_PROGRESS_AFTER")) {
    std::string_view text = set;
    std::from_chars(text.data(), text.data() + text.size(), seconds);
  }
  return std::chrono::duration<double>(std::clamp(seconds, 0.0, 1e6));
}

Progress::Progress(std::string label)
    : label(std::move(label)), after(readThreshold()),
      isTerminal(isatty(STDERR_FILENO) == 1) {
  if (!isTerminal)
    return;
  if (after.count() == 0) {
    std::lock_guard lock(mutex);
    draw();
  }
  try {
    watcher = std::thread([this] { watch(); });
  } catch (const std::system_error &) {
    // Without a thread to spare the work goes on unseen.
  }
}

Progress::~Progress() {
  {
    std::lock_guard lock(mutex);
    hasEnded = true;
  }
  ended.notify_one();
  if (watcher.joinable())
    watcher.join();
  wipe();
}

void Progress::update(double part) {
  std::lock_guard lock(mutex);
  done = part > 0 ? std::min(part, 1.0) : 0;
  if (isTerminal && after.count() == 0)
    draw();
}

void Progress::say(const std::string &line) {
  std::lock_guard lock(mutex);
  bool wasShown = isShown;
  wipe();
  std::fprintf(stderr, "%s\n", line.c_str());
  if (wasShown)
    draw();
}

void Progress::watch() {
  std::unique_lock lock(mutex);
  auto hasEndedBy = [&](auto time) {
    return ended.wait_for(lock, time, [&] { return hasEnded; });
  };
  for (bool isOver = hasEndedBy(after); !isOver; isOver = hasEndedBy(100ms))
    draw();
}

void Progress::draw() {
  std::string text = label;
  if (done >= 0) {
    constexpr int width = 40;
    std::string bar(static_cast<size_t>(done * width), '#');
    bar.resize(width, '.');
    text +=
        " [" + bar + "] " + std::to_string(static_cast<int>(done * 100)) + "%";
  } else {
    auto seconds =
        std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - start);
    text += " ... " + std::to_string(seconds.count()) + " s";
  }
  std::fprintf(stderr, "\r%s\x1b[K", text.c_str());
  std::fflush(stderr);
  isShown = true;
}

void Progress::wipe() {
  if (isShown)
    std::fputs("\r\x1b[K", stderr);
  isShown = false;
}
