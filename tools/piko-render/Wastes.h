//===- Wastes.h - What a frame does in vain ---------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_WASTES_H
#define PIKO_TOOLS_PIKORENDER_WASTES_H

#include "Work.h"

namespace piko::render {

struct Waste {
  double milliseconds; ///< Of a frame, estimated.
  std::string what;    ///< One sentence, without a full stop.
  std::string advice;  ///< The directive or parameter that would remove it.
};

/// The wastes of a frame, the largest first. Time is measured where the runtime
/// knows it; what stages waste is their share of the kernels' time, by the
/// operations that are counted. Lanes are those of a CPU.
std::vector<Waste> findWastes(const Work &work, pikort_pipeline *timed,
                              bool isCPU);

/// The three largest of them, for people.
std::string printWastes(const std::vector<Waste> &wastes);

/// All of them, for programs.
Json reportWastes(const std::vector<Waste> &wastes);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_WASTES_H
