//===- Against.h - A run on several targets ---------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_PIKORENDER_AGAINST_H
#define PIKO_TOOLS_PIKORENDER_AGAINST_H

#include "Options.h"

#include "Piko/Scene/Json.h"

#include <string>
#include <vector>

namespace piko::render {

/// How a target's first run agrees with that of the options' own target.
struct Agreement {
  std::string target;
  bool hasRun = false;
  bool isEqual = false;  ///< bit for bit, but for NaNs and padding
  bool isWithin = false; ///< as the tolerance allows
  double relative = 0;   ///< the largest relative difference
  std::vector<std::string> differences = {};
  std::string error = {}; ///< why it has not run, unless that is already said
};

/// Runs once on each target that the options name, with input of its own each
/// time, and compares all state. The error is of the options' own target.
Result<std::vector<Agreement>> runAgainst(const Options &options);

/// Whether all targets agree.
bool agree(const std::vector<Agreement> &agreements);

std::string printAgreements(const std::vector<Agreement> &agreements);
Json reportAgreements(const std::vector<Agreement> &agreements);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_AGAINST_H
