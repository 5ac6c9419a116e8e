// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- host.cpp - What a function of the maths costs ----------------------===//
//
// Prints, for each contender, its name and the nanoseconds of a call: the
// median over many passes, in so many seconds. MATHS_SCALAR and MATHS_VECTORS
// are the headers of the compiled pipeline, in namespaces of these names, and
// MATHS_NEAR1 and MATHS_NEAR4 those of vectors that may be 1 and 4 ULP away.
//
//===----------------------------------------------------------------------===//

#include MATHS_SCALAR
#include MATHS_VECTORS
#include MATHS_NEAR1
#include MATHS_NEAR4

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#ifdef MATHS_SLEEF
#include <sleef.h>
#endif

#define MATHS_PASTE(a, b, c) a##b##c
#define MATHS_NAME(a, b, c) MATHS_PASTE(a, b, c)
#define SLEEF(suffix) MATHS_NAME(Sleef_, MATHS_FUNCTION, suffix)

namespace {

using Clock = std::chrono::steady_clock;

double seconds = 0.1;
std::vector<float> in(16384);

/// Runs a pass until the time is up.
template <class Pass> void measure(const char *name, Pass &&pass) {
  std::vector<double> times;
  pass();
  auto begin = Clock::now();
  do {
    auto start = Clock::now();
    pass();
    times.push_back(
        std::chrono::duration<double, std::nano>(Clock::now() - start).count());
  } while (std::chrono::duration<double>(Clock::now() - begin).count() <
           seconds);
  auto middle = times.begin() + static_cast<long>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  std::printf("%s %.4f\n", name, *middle / double(in.size()));
}

template <class Pipe> std::vector<float> measurePipe(const char *name) {
  std::vector<int> one(1);
  std::vector<float> out(in.size());
  Pipe pipe;
  pipe.setDomain({1, 1});
  pipe.setThreads(1);
  pipe.state().in.bind(in);
  pipe.state().out.bind(out);
  pipe.feed(pipe.apply, one);
  measure(name, [&] { pipe.run(); });
  return out;
}

/// Keeps the compiler from leaving out what nobody reads.
void use(std::vector<float> &out) {
  __asm__ volatile("" ::"r"(out.data()) : "memory");
}

} // namespace

int main(int argc, char **argv) {
  if (argc > 1)
    seconds = std::atof(argv[1]);
  for (size_t i = 0; i < in.size(); ++i)
    in[i] =
        float(MATHS_LOW + (MATHS_HIGH - MATHS_LOW) *
                              double(i * 7919 % in.size()) / double(in.size()));
  std::vector<float> one = measurePipe<scalar::Maths>("scalar");
  std::vector<float> out = measurePipe<vectors::Maths>("vectors");
  if (std::memcmp(one.data(), out.data(), out.size() * sizeof(float)) != 0) {
    std::fprintf(stderr, "expected the same bits of one lane and of all\n");
    return 1;
  }
  measurePipe<near1::Maths>("near1");
  measurePipe<near4::Maths>("near4");
  measure("libm", [&] {
    for (size_t i = 0; i < in.size(); ++i)
      out[i] = std::MATHS_FUNCTION(in[i]);
    use(out);
  });
#ifdef MATHS_SLEEF
  measure("sleef", [&] {
    for (size_t i = 0; i < in.size(); ++i)
      out[i] = SLEEF(f_u10)(in[i]);
    use(out);
  });
#if defined(__AVX512F__)
  measure("sleef-vectors", [&] {
    for (size_t i = 0; i < in.size(); i += 16)
      _mm512_storeu_ps(&out[i], SLEEF(f16_u10avx512f)(_mm512_loadu_ps(&in[i])));
    use(out);
  });
#elif defined(__AVX2__)
  measure("sleef-vectors", [&] {
    for (size_t i = 0; i < in.size(); i += 8)
      _mm256_storeu_ps(&out[i], SLEEF(f8_u10avx2)(_mm256_loadu_ps(&in[i])));
    use(out);
  });
#endif
#endif
  return 0;
}
