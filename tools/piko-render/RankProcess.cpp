//===- RankProcess.cpp - This process as one rank of several --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "RankProcess.h"

#include <algorithm>
#include <cstdio>
#include <dlfcn.h>
#include <utility>

using namespace piko;
using namespace piko::render;

RankProcess &render::rankProcess() {
  static RankProcess process;
  return process;
}

Result<Done> RankProcess::start(Options &options) {
  if (!options.usesMPI)
    return Done{};
  // It stays until the process ends, as MPI may have threads.
  void *library = dlopen(PIKO_MPI_LIBRARY, RTLD_NOW | RTLD_GLOBAL);
  auto startMPI = reinterpret_cast<int32_t (*)(double, pikort_ranks *)>(
      library ? dlsym(library, "pikort_start_mpi") : nullptr);
  stopMPI = reinterpret_cast<int32_t (*)(pikort_ranks *, int32_t)>(
      library ? dlsym(library, "pikort_stop_mpi") : nullptr);
  if (!startMPI || !stopMPI)
    return Error{"--mpi: expected a build with MPI, but there is no " +
                 std::string(PIKO_MPI_LIBRARY)};
  bool works = startMPI(options.rankSeconds, &self) == PIKORT_OK;
  isStarted = true;
  if (!works)
    return Error{
        "--mpi: rank " + std::to_string(self.rank) + ": " +
        (self.message ? self.message(self.context) : "MPI does not start")};
  if (self.rank == 0)
    return Done{};
  // It runs all that the first one does.
  options.images.clear();
  if (!options.trace.empty())
    options.trace = "/dev/null";
  if (!std::freopen("/dev/null", "w", stdout))
    return Error{"--mpi: expected to write to /dev/null"};
  return Done{};
}

std::string RankProcess::stop(bool fails) {
  bool stops = std::exchange(isStarted, false);
  if (!stops || stopMPI(&self, fails) == PIKORT_OK)
    return {};
  std::string wrong =
      "rank " + std::to_string(self.rank) + ": " + self.message(self.context);
  std::fprintf(stderr, "piko-render: error: %s\n", wrong.c_str());
  std::fflush(stderr);
  stopMPI(&self, /*fails=*/true);
  return wrong;
}

std::string render::printTraffic(pikort_pipeline *pipeline) {
  int32_t count = pikort_rank_count(pipeline);
  double runs = double(std::max<int64_t>(1, pikort_stats_runs(pipeline)));
  std::string all;
  auto print = [&](const char *format, auto... values) {
    char line[256];
    std::snprintf(line, sizeof line, format, values...);
    all += line;
  };
  for (int32_t rank = 0; rank < count; ++rank) {
    pikort_rank_totals totals;
    if (pikort_get_rank_totals(pipeline, rank, &totals) == PIKORT_OK)
      print("  rank %d sends %.0f bytes; its queues hold at most %lld\n", rank,
            double(totals.bytes) / runs, static_cast<long long>(totals.peak));
  }
  for (int32_t i = 0; i < pikort_rank_traffic_count(pipeline); ++i) {
    pikort_rank_traffic edge;
    if (pikort_get_rank_traffic(pipeline, i, &edge) != PIKORT_OK)
      continue;
    if (edge.from)
      print("  first rank, %s to %s: sends %.0f primitives, %.0f bytes; keeps "
            "%.0f\n",
            edge.from, edge.to, double(edge.records) / runs,
            double(edge.bytes) / runs, double(edge.kept) / runs);
    else
      print("  first rank, state %s: sends %.0f bytes\n", edge.to,
            double(edge.bytes) / runs);
  }
  return all.empty() ? all : "what ranks exchange in a frame:\n" + all;
}

bool render::setRanks(const Options &options, pikort_pipeline *pipeline) {
  if (rankProcess().isOne())
    return pikort_set_ranks(pipeline, &rankProcess().ranks()) == PIKORT_OK;
  return options.ranks == 0 ||
         pikort_set_thread_ranks(pipeline, options.ranks) == PIKORT_OK;
}
