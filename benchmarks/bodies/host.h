// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- host.h - What runs a body, the same for every build of it ----------===//
//
// A body is a pipeline file with a host after it, for -DPIKO_BODY: a struct
// that holds what goes in and out, binds it to a pipeline and gives a hash of
// what came out. With -DPIKO_BODY_HEADER="..." the pipeline is the one that
// pikoc has compiled, or else the reference executor's.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_BENCHMARKS_BODIES_HOST_H
#define PIKO_BENCHMARKS_BODIES_HOST_H

#ifdef PIKO_BODY_HEADER
#include PIKO_BODY_HEADER
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>
#include <time.h>
#include <vector>

namespace bodies {

/// The same numbers on every machine.
struct Random {
  uint32_t state = 1;
  uint32_t next() { return (state = state * 1664525u + 1013904223u) >> 8; }
  uint32_t below(uint32_t n) { return next() % n; }
  float unit() { return float(next()) / float(1 << 24); }
  float in(float lo, float hi) { return lo + (hi - lo) * unit(); }
};

template <class Buffer, class T>
void bind(Buffer &&buffer, std::vector<T> &elements) {
  if constexpr (requires { buffer.bind(elements); })
    buffer.bind(elements);
  else
    buffer.bind(elements.data(), int64_t(elements.size()));
}

inline uint64_t hash(const void *data, size_t size) {
  uint64_t value = 14695981039346656037u;
  for (size_t i = 0; i < size; ++i)
    value =
        (value ^ static_cast<const unsigned char *>(data)[i]) * 1099511628211u;
  return value;
}
template <class T> uint64_t hash(const std::vector<T> &elements) {
  return hash(elements.data(), elements.size() * sizeof(T));
}
/// Of an image or a buffer that the pipeline allocates.
template <class Elements> uint64_t hashState(Elements &&state) {
  if constexpr (requires { state.view(); }) {
    auto view = state.view();
    return hash(view.elements.data(), view.elements.size_bytes());
  } else {
    return hash(state.data(), state.size() * sizeof(*state.data()));
  }
}

/// Of this thread's processor time, or of the wall, for several threads.
inline double now(int threads) {
  timespec time;
  clock_gettime(threads > 1 ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

template <class Pipe> void runOnce(Pipe &pipe) {
  if constexpr (requires { pipe.run().orThrow(); })
    pipe.run().orThrow();
  else
    pipe.run();
}

/// Prints the loops that a pipeline holds in two versions, as lines of JSON.
template <class Pipe> void printMappings(Pipe &pipe) {
#ifdef PIKO_BODY_HEADER
  for (int i = 0; i < pikort_mapping_count(pipe.get()); ++i) {
    pikort_mapping_info info;
    if (pikort_get_mapping(pipe.get(), i, &info) != PIKORT_OK)
      continue;
    auto name = [](int vectors) { return vectors ? "vectors" : "scalar"; };
    std::printf("{\"kernel\": \"%s\", \"number\": %d, \"within\": %d, "
                "\"loop\": \"%s\", \"runs\": \"%s\", \"expected\": "
                "\"%s\", \"expected_ratio\": %.6g}\n",
                info.kernel, info.number, info.within, info.loop,
                name(info.vectors), name(info.expected), info.expected_ratio);
  }
#else
  (void)pipe; // the reference has none
#endif
}

/// Prints the hash of the first frame and the fewest milliseconds of a warm
/// one, of those that fit in so many seconds, on so many threads; and, where
/// the host counts them, a frame's operations on floats, as the text has them,
/// and the bytes that it must read or write at least once. With --mappings as
/// the third argument, the pipeline's loops that are held in two versions.
template <class Pipe, class Host> int measure(int argc, char **argv) {
  double seconds = argc > 1 ? std::atof(argv[1]) : 1;
  int threads = argc > 2 ? std::atoi(argv[2]) : 1;
  try {
    Pipe pipe;
    Host host;
    if constexpr (requires { pipe.setThreads(1); })
      pipe.setThreads(threads);
    host.bind(pipe);
    runOnce(pipe);
    uint64_t result = host.result(pipe);
    double best = 1e9, begin = now(threads);
    do {
      double start = now(threads);
      runOnce(pipe);
      best = std::min(best, now(threads) - start);
    } while (now(threads) - begin < seconds);
    std::printf("%016llx %.6f", static_cast<unsigned long long>(result),
                1e3 * best);
    if constexpr (requires { host.flops(), host.bytes(); })
      std::printf(" %.0f %.0f", host.flops(), host.bytes());
    std::printf("\n");
    if (argc > 3 && std::string_view(argv[3]) == "--mappings")
      printMappings(pipe);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}

} // namespace bodies

#ifdef PIKO_BODY_HEADER
#define PIKO_BODY_MAIN(PIPE, HOST)                                             \
  int main(int argc, char **argv) {                                            \
    return bodies::measure<pipelines::PIPE, HOST>(argc, argv);                 \
  }
#else
#define PIKO_BODY_MAIN(PIPE, HOST)                                             \
  int main(int argc, char **argv) {                                            \
    return bodies::measure<PIPE, HOST>(argc, argv);                            \
  }
#endif

#endif // PIKO_BENCHMARKS_BODIES_HOST_H
