// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- JoinBenchmark.cpp - What an edge costs -----------------------------===//
//
// A source of N primitives, a stage that emits one record of 48 bytes for each,
// and a stage that takes them, over an edge of each kind. Prints milliseconds
// for the emitting loop and for the join, and nanoseconds for each record and
// thread; and memcpy of the same bytes, for comparison.
//
//   piko-runtime-benchmark [RECORDS [THREADS [FRAMES]]]
//
//===----------------------------------------------------------------------===//

#include "pikort/emission.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <omp.h>
#include <vector>

namespace {

struct Record {
  float value[12];
};
static_assert(sizeof(Record) == 48);

/// How the emitted records are placed, and from what the producer emits.
struct Case {
  const char *name;
  bool placed;   ///< The consumer is binned: 32 x 24 bins.
  bool fromBins; ///< The producer is binned too: counts are permuted back.
  int64_t cells; ///< Places of each record.
  bool coherent; ///< Neighbours go to the same bin.
};
const Case *current;
double loopMilliseconds;

double now() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

int64_t cellOf(int64_t i) {
  auto u = static_cast<uint64_t>(i);
  return static_cast<int64_t>(
      (current->coherent ? u / 100 : u * 2654435761u >> 7) % 700);
}

void setup(pikort_pipeline *p) {
  pikoir_declare_pipeline(p, "Join", 2);
  pikoir_declare_record(p, 0, "Record", sizeof(Record), 4);
  pikoir_declare_field(p, 0, "value", PIKORT_F32, 0, 12, 4);
  int64_t bins[] = {32, 32}, whole[] = {0, 0};
  pikoir_declare_stage(p, 0, "first", 0, current->fromBins ? bins : whole, 0, 0,
                       PIKOIR_SPLIT | (current->fromBins ? PIKOIR_PLACED : 0),
                       0);
  pikoir_declare_stage(p, 1, "second", 0, current->placed ? bins : whole, 0, 0,
                       PIKOIR_SPLIT | (current->placed ? PIKOIR_PLACED : 0), 0);
  pikoir_declare_source(p, 0, 0);
  pikoir_declare_edge(p, 0, 0, 1);
}

int32_t runBins(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin_source(p, 0);
  if (!in)
    return pikoir_status(p);
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open_source(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      pikoir_place_source(w, cellOf(i));
      pikoir_next(w);
    }
    pikoir_close(w);
  }
  return pikoir_end_source(p, 0);
}

int32_t run(pikort_pipeline *p) {
  if (current->fromBins)
    if (int32_t status = runBins(p))
      return status;
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  double start = now();
#pragma omp parallel for schedule(dynamic) num_threads(pikoir_threads(p))
  for (int64_t u = 0; u < in->unit_count; ++u) {
    pikoir_writer *w = pikoir_open(p, 0, u);
    for (int64_t i = in->units[u].begin; i < in->units[u].end; ++i) {
      int64_t item = in->order ? in->order[i] : i;
      uint8_t *record = pikoir_append_inline(w, 0);
      std::memcpy(record, in->items + item * 48, 48);
      if (current->placed)
        for (int64_t c = 0; c < current->cells; ++c)
          pikoir_place_inline(w, 0, cellOf(item) + c);
      pikoir_next_inline(w);
    }
    pikoir_close(w);
  }
  loopMilliseconds = now() - start;
  if (int32_t status = pikoir_end(p, 0))
    return status;
  if (!pikoir_begin(p, 1))
    return pikoir_status(p);
  return pikoir_end(p, 1);
}

void measure(const Case &which, const std::vector<Record> &records, int threads,
             int frames) {
  current = &which;
  pikort_program program{PIKORT_ABI_VERSION, "Join", setup, run};
  pikort_pipeline *p = nullptr;
  int64_t extent[] = {1024, 768};
  auto count = static_cast<int64_t>(records.size());
  auto expect = [&](int32_t status) {
    if (status) {
      std::fprintf(stderr, "%s\n", pikort_message(p));
      std::exit(1);
    }
  };
  expect(pikort_create(&program, &p));
  expect(pikort_set_domain(p, 2, extent));
  expect(pikort_set_threads(p, threads));
  expect(pikort_bind_source(p, 0, records.data(), count, sizeof(Record)));
  for (int i = 0; i < 3; ++i)
    expect(pikort_run(p));
  double loop = 1e30, join = 1e30;
  for (int i = 0; i < frames; ++i) {
    pikort_reset_stats(p);
    loopMilliseconds = 0;
    expect(pikort_run(p));
    pikort_kernel_stats stats;
    expect(pikort_get_kernel_stats(p, pikort_kernel_count(p) - 1, &stats));
    loop = std::min(loop, loopMilliseconds);
    join = std::min(join, stats.join_milliseconds);
  }
  double scale = 1e6 * threads / static_cast<double>(count);
  std::printf("%-34s emit %7.2f ms %6.2f ns   join %7.2f ms %6.2f ns   peak "
              "%.0f MB\n",
              which.name, loop, loop * scale, join, join * scale,
              static_cast<double>(pikort_peak_bytes(p)) / 1e6);
  pikort_destroy(p);
}

void measureCopy(const std::vector<Record> &records, int threads, int frames) {
  std::vector<Record> to(records.size());
  double best = 1e30;
  auto bytes = static_cast<int64_t>(records.size() * sizeof(Record));
  for (int i = 0; i < frames + 3; ++i) {
    double start = now();
    constexpr int64_t chunk = 1 << 18;
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (int64_t at = 0; at < bytes; at += chunk)
      std::memcpy(reinterpret_cast<char *>(to.data()) + at,
                  reinterpret_cast<const char *>(records.data()) + at,
                  static_cast<size_t>(std::min(chunk, bytes - at)));
    best = std::min(best, now() - start);
  }
  std::printf("%-34s %.2f ms, %.1f GB/s\n", "memcpy of the records", best,
              static_cast<double>(bytes) / best / 1e6);
}

} // namespace

int main(int argc, char **argv) {
  long count = argc > 1 ? std::atol(argv[1]) : 1500000;
  int threads = argc > 2 ? std::atoi(argv[2]) : omp_get_max_threads();
  int frames = argc > 3 ? std::atoi(argv[3]) : 20;
  if (count < 1 || threads < 1 || frames < 1) {
    std::fprintf(stderr, "usage: %s [RECORDS [THREADS [FRAMES]]]\n", argv[0]);
    return 1;
  }
  std::vector<Record> records(static_cast<size_t>(count));
  std::printf("%ld records of 48 bytes, %d threads, best of %d frames; ns are "
              "for a record and thread\n",
              count, threads, frames);
  measureCopy(records, threads, frames);
  static const Case cases[] = {
      {"concatenate", false, false, 0, false},
      {"place, 1 cell, scattered", true, false, 1, false},
      {"place, 1 cell, coherent", true, false, 1, true},
      {"place, 4 cells, scattered", true, false, 4, false},
      {"bins to whole, permuted", false, true, 0, false},
      {"bins to bins, permuted, 1 cell", true, true, 1, false},
      {"bins to bins, permuted, coherent", true, true, 1, true},
  };
  for (const Case &which : cases)
    measure(which, records, threads, frames);
  return 0;
}
