//===- ProgressBar.cpp - A bar on the terminal ----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/ProgressBar.h"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

using namespace piko::render;
using namespace std::chrono_literals;

ProgressBar::ProgressBar(std::string label)
    : label(std::move(label)), isTerminal(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (isShown)
    std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::update(double part) {
  Clock::time_point now = Clock::now();
  if (!isTerminal || now - start < 500ms || (isShown && now - drawn < 50ms))
    return;
  constexpr int width = 40;
  part = part > 0 ? std::min(part, 1.0) : 0;
  int filled = static_cast<int>(part * width);
  std::string bar(filled, '#');
  bar.resize(width, '.');
  std::fprintf(stderr, "\r%s [%s] %3d%%", label.c_str(), bar.c_str(),
               static_cast<int>(part * 100));
  std::fflush(stderr);
  isShown = true;
  drawn = now;
}
