// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Headers are parsed for the machine that they are written for, and only what a
// phase calls is judged: all of C++20's and C's, POSIX's and the machine's own.
// Types have the layout that they have for other compilers.
// RUN: piko-translate --cpp-to-piko %s 2>&1 | FileCheck %s
// RUN: %if all %{ %other_cxx -std=c++20 -fsyntax-only -I %piko_include %s %}
// RUN: %if all %{ %cxx_reference -fsyntax-only %s %}
#include <algorithm>
#include <any>
#include <array>
#include <assert.h>
#include <atomic>
#include <barrier>
#include <bit>
#include <bitset>
#include <cassert>
#include <cctype>
#include <cerrno>
#include <cfenv>
#include <cfloat>
#include <charconv>
#include <chrono>
#include <cinttypes>
#include <climits>
#include <clocale>
#include <cmath>
#include <codecvt>
#include <compare>
#include <complex.h>
#include <complex>
#include <concepts>
#include <condition_variable>
#include <coroutine>
#include <csetjmp>
#include <csignal>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <ctype.h>
#include <cuchar>
#include <cwchar>
#include <cwctype>
#include <deque>
#include <errno.h>
#include <exception>
#include <execution>
#include <fenv.h>
#include <filesystem>
#include <float.h>
#include <forward_list>
#include <fstream>
#include <functional>
#include <future>
#include <initializer_list>
#include <inttypes.h>
#include <iomanip>
#include <ios>
#include <iosfwd>
#include <iostream>
#include <iso646.h>
#include <istream>
#include <iterator>
#include <latch>
#include <limits.h>
#include <limits>
#include <list>
#include <locale.h>
#include <locale>
#include <map>
#include <math.h>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <new>
#include <numbers>
#include <numeric>
#include <optional>
#include <ostream>
#include <queue>
#include <random>
#include <ranges>
#include <ratio>
#include <regex>
#include <scoped_allocator>
#include <semaphore>
#include <set>
#include <setjmp.h>
#include <shared_mutex>
#include <signal.h>
#include <source_location>
#include <span>
#include <sstream>
#include <stack>
#include <stdalign.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdexcept>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <stop_token>
#include <streambuf>
#include <string.h>
#include <string>
#include <string_view>
#include <syncstream>
#include <system_error>
#include <tgmath.h>
#include <thread>
#include <time.h>
#include <tuple>
#include <type_traits>
#include <typeindex>
#include <typeinfo>
#include <uchar.h>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <valarray>
#include <variant>
#include <vector>
#include <version>
#include <wchar.h>
#include <wctype.h>

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <fpu_control.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#include <x86intrin.h>
#elif defined(__aarch64__)
#include <arm_acle.h>
#include <arm_neon.h>
#endif

#include <piko.h>

#if defined(__x86_64__)
static_assert(sizeof(long double) == 16 && alignof(long double) == 16);
static_assert(sizeof(va_list) == 24 && alignof(std::max_align_t) == 16);
static_assert(sizeof(__m256) == 32 && sizeof(std::jmp_buf) == 200);
#ifndef __SSE2__
#error every such machine has it
#endif
#endif
static_assert(sizeof(wchar_t) == 4 && sizeof(size_t) == 8);
static_assert(sizeof(__int128) == 16 && sizeof(std::atomic<int64_t>) == 8);

// What the host does is its own.
thread_local int perThread;
struct Base {
  virtual ~Base() = default;
};
struct Derived : Base {};
int runHost(Base &base) {
  if (!dynamic_cast<Derived *>(&base) || typeid(base) == typeid(Base))
    throw std::runtime_error("no");
  std::atomic<int> count = 0;
  std::thread([&] { ++count; }).join();
  asm volatile("" : : "r"(count.load()) : "memory");
  try {
    return std::stoi("12") + ++perThread;
  } catch (const std::exception &) {
    return 0;
  }
}

struct Item {
  float x;
  uint32_t bits;
};

// CHECK-NOT: error
// CHECK-LABEL: piko.stage @algorithms
struct Algorithms : piko::Stage<0, 0, 1, Item, Item> {
  void process(const Item &item) {
    std::array<float, 3> values{item.x, 2, 1};
    std::swap(values[0], values[2]);
    std::optional<float> best;
    for (float value : std::span(values))
      best = best ? std::max(*best, value) : value;
    // CHECK-DAG: math.ctpop
    // CHECK-DAG: arith.bitcast
    Item out{std::clamp(*best, 0.0f, 1.0f),
             std::popcount(item.bits) + std::bit_cast<uint32_t>(item.x)};
    // CHECK: piko.emit
    emit(out);
  }
};
// CHECK-LABEL: piko.stage @vectors
struct Vectors : piko::Stage<0, 0, 1, Item> {
  void process(const Item &item) { (void)item; }
};
struct Pipeline : piko::Pipe<> {
  Algorithms algorithms;
  Vectors vectors;
  Pipeline() {
    source(algorithms);
    connect(algorithms, 0, vectors);
  }
};
