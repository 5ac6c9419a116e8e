// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CompiledKernelsTest.cpp - Kernels that Clang has compiled ----------===//
//
// The kernels are in the folder `kernels`, in C++; CMakeLists.txt has them
// compiled with and without optimisation.
//
//===----------------------------------------------------------------------===//

#include "test/DriverFixture.h"

#include <algorithm>
#include <bit>
#include <fstream>
#include <iterator>
#include <numeric>

using namespace piko::testdriver;

namespace {

/// Its parameter is the level of optimisation.
class CompiledKernelsTest : public DriverTest,
                            public testing::WithParamInterface<const char *> {
protected:
  CUfunction kernelOf(const std::string &file, const char *name) {
    std::ifstream stream(std::string(PIKO_TEST_KERNELS) + "/" + file + "." +
                         GetParam() + ".ptx");
    EXPECT_TRUE(stream.good()) << file;
    return load({std::istreambuf_iterator<char>(stream), {}}, name);
  }

  /// Memory that is managed, with these numbers; it is freed under the test.
  uint32_t *put(const std::vector<uint32_t> &numbers) {
    CUdeviceptr address = 0;
    EXPECT_EQ(cuMemAllocManaged(&address, numbers.size() * sizeof(uint32_t),
                                CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    memory.push_back(address);
    auto *place = reinterpret_cast<uint32_t *>(address);
    std::copy(numbers.begin(), numbers.end(), place);
    return place;
  }

  void TearDown() override {
    for (CUdeviceptr address : memory)
      EXPECT_EQ(cuMemFree(address), CUDA_SUCCESS);
    DriverTest::TearDown();
  }

  static uint64_t of(const void *pointer) {
    return reinterpret_cast<uint64_t>(pointer);
  }

private:
  std::vector<CUdeviceptr> memory;
};

TEST_P(CompiledKernelsTest, ScanInOneCooperativeLaunch) {
  constexpr uint32_t count = 100000;
  std::vector<uint32_t> numbers(count), sums(count);
  for (uint32_t i = 0; i < count; ++i)
    numbers[i] = i * 2654435761u >> 20;
  std::inclusive_scan(numbers.begin(), numbers.end(), sums.begin());
  CUfunction scan = kernelOf("Scan", "scan");
  int blocks = 0;
  ASSERT_EQ(cuOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, scan, 128, 0),
            CUDA_SUCCESS);
  blocks *= 4; // multiprocessors
  uint32_t *in = put(numbers), *out = put(std::vector<uint32_t>(count)),
           *parts = put(std::vector<uint32_t>(128)), *counter = put({0});
  EXPECT_EQ(launchTogether(scan, static_cast<unsigned>(blocks), 128,
                           {of(in), of(out), count, of(parts), of(counter)}),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_TRUE(std::equal(sums.begin(), sums.end(), out));
  EXPECT_EQ(*counter, 2 * static_cast<uint32_t>(blocks));
}

TEST_P(CompiledKernelsTest, GridBarriers) {
  constexpr uint32_t blocks = 5, threads = 64;
  for (const char *name : {"topBit", "senseReversing", "flags", "allThreads",
                           "lock", "together"}) {
    uint32_t *slots = put(std::vector<uint32_t>(blocks)), *missing = put({0}),
             *state = put(std::vector<uint32_t>(blocks));
    EXPECT_EQ(launchTogether(kernelOf("GridBarriers", name), blocks, threads,
                             {of(slots), of(missing), of(state)}),
              CUDA_SUCCESS)
        << name << ": " << pikoTestDriverError();
    EXPECT_EQ(*missing, 0u) << name;
    EXPECT_EQ(std::count(slots, slots + blocks, 4u), blocks) << name;
  }
}

TEST_P(CompiledKernelsTest, Atomics) {
  constexpr uint32_t all = 4 * 64;
  uint32_t *out = put({0, 0, ~0u, 0, ~0u, 0, 0, 0});
  uint32_t *wide = put({0, 0, 0, 0});
  EXPECT_EQ(
      launch(kernelOf("Operations", "atomics"), 4, 64, {of(out), of(wide)}),
      CUDA_SUCCESS)
      << pikoTestDriverError();
  constexpr uint32_t sum = all * (all - 1) / 2;
  const uint32_t expected[] = {all, all - 1, 0, ~0u, 0, 0, sum, 5};
  EXPECT_TRUE(std::equal(std::begin(expected), std::end(expected), out));
  EXPECT_EQ(wide[0], 0u);
  EXPECT_EQ(wide[1], sum);
  EXPECT_EQ(wide[3], 2 * (all - 1));
}

TEST_P(CompiledKernelsTest, LastThread) {
  constexpr uint32_t all = 3 * 48;
  uint32_t *out = put(std::vector<uint32_t>(all)), *counter = put({0}),
           *result = put({0});
  EXPECT_EQ(launch(kernelOf("Operations", "lastThread"), 3, 48,
                   {of(out), of(counter), of(result)}),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  EXPECT_EQ(*result, all * (all - 1) / 2);
}

TEST_P(CompiledKernelsTest, WarpOperations) {
  uint32_t *out = put(std::vector<uint32_t>(320));
  EXPECT_EQ(launch(kernelOf("Operations", "warpOperations"), 1, 32, {of(out)}),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  for (uint32_t lane = 0; lane < 32; ++lane) {
    const uint32_t expected[] = {0x49249249,
                                 1,
                                 0,
                                 0xffu << lane / 8 * 8,
                                 25,
                                 lane ^ 1,
                                 lane + 4 < 32 ? lane + 4 : lane,
                                 lane / 2,
                                 5,
                                 1};
    const uint32_t *mine = out + size_t(10) * lane;
    EXPECT_EQ(std::vector(mine, mine + 10),
              std::vector(std::begin(expected), std::end(expected)))
        << lane;
  }
}

TEST_P(CompiledKernelsTest, Bits) {
  const std::vector<uint32_t> in{0,          1,          2,          3,
                                 0x80000000, 0xdeadbeef, 0x12345678, ~0u};
  uint32_t *from = put(in), *out = put(std::vector<uint32_t>(64));
  EXPECT_EQ(launch(kernelOf("Operations", "bits"), 1, 8, {of(out), of(from)}),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  for (size_t i = 0; i < in.size(); ++i) {
    const uint32_t value = in[i];
    constexpr uint64_t weights[] = {1, 10, 100, 1000};
    constexpr uint32_t table[] = {7, 11, 13, 17};
    uint32_t reversed = 0;
    for (int bit = 0; bit < 32; ++bit)
      reversed |= (value >> bit & 1) << (31 - bit);
    const uint32_t expected[] = {
        static_cast<uint32_t>(std::popcount(value)),
        static_cast<uint32_t>(std::countl_zero(value | 1)),
        static_cast<uint32_t>(std::countr_zero(value | 1u << 31)),
        reversed,
        __builtin_bswap32(value),
        static_cast<uint32_t>(value * weights[value % 4] >> 7),
        std::rotl(value, 9) + table[value & 3] * value,
        table[2 + (value & 1)]};
    EXPECT_EQ(std::vector(out + 8 * i, out + 8 * i + 8),
              std::vector(std::begin(expected), std::end(expected)))
        << value;
  }
}

TEST_P(CompiledKernelsTest, Memories) {
  uint32_t *out = put(std::vector<uint32_t>(64));
  EXPECT_EQ(launch(kernelOf("Operations", "memories"), 1, 64, {of(out)}),
            CUDA_SUCCESS)
      << pikoTestDriverError();
  std::vector<uint32_t> steps, largest;
  for (uint64_t value = 1; value <= 64; ++value) {
    steps.push_back(0);
    largest.push_back(0);
    for (uint64_t it = value; it != 1; ++steps.back()) {
      largest.back() = std::max(largest.back(), static_cast<uint32_t>(it));
      it = it % 2 ? 3 * it + 1 : it / 2;
    }
    largest.back() = std::max(largest.back(), 1u);
  }
  for (size_t i = 0; i < 64; ++i)
    EXPECT_EQ(out[i], steps[63 - i] * (largest[63 - i] % 8) + largest[i]) << i;
}

INSTANTIATE_TEST_SUITE_P(Levels, CompiledKernelsTest,
                         testing::Values("O0", "O3"),
                         [](const auto &it) { return it.param; });

} // namespace
