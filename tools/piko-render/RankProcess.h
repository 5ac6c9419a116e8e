//===- RankProcess.h - This process as one rank of several ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// With --mpi each process does all that the command line says, but the first
// one alone prints and writes.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKORENDER_RANKPROCESS_H
#define PIKO_TOOLS_PIKORENDER_RANKPROCESS_H

#include "Options.h"

#include <pikort/ranks.h>

namespace piko::render {

class RankProcess {
public:
  /// Starts MPI if the options say so.
  Result<Done> start(Options &options);
  /// Ends it; with `fails` all processes. What is wrong if others do not come
  /// to the end; then they have been ended.
  std::string stop(bool fails);
  bool isOne() const { return isStarted; }
  const pikort_ranks &ranks() const { return self; }

private:
  bool isStarted = false;
  pikort_ranks self{};
  int32_t (*stopMPI)(pikort_ranks *, int32_t) = nullptr;
};

/// The one of this process.
RankProcess &rankProcess();

/// What ranks have exchanged in a frame, in words; empty without ranks.
std::string printTraffic(pikort_pipeline *pipeline);

/// Makes a pipeline one rank of several, as the options say.
bool setRanks(const Options &options, pikort_pipeline *pipeline);

} // namespace piko::render

#endif // PIKO_TOOLS_PIKORENDER_RANKPROCESS_H
