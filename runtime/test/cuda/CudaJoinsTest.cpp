// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaJoinsTest.cpp - Barriers of the runtime's own grids ------------===//

#include "Symbols.h"
#include "cuda/CudaFixture.h"
#include "cuda/device/Joins.h"

#include <cstdint>
#include <fstream>
#include <iterator>

using namespace piko::cuda;
using piko::rt::Pipeline;

namespace {

/// One object in memory of the current context.
template <class T> class OnDevice {
public:
  explicit OnDevice(const T &value) {
    EXPECT_EQ(cuMemAlloc(&address_, sizeof(T)), CUDA_SUCCESS);
    EXPECT_EQ(cuMemcpyHtoDAsync(address_, &value, sizeof(T), nullptr),
              CUDA_SUCCESS);
  }
  OnDevice(const OnDevice &) = delete;
  OnDevice &operator=(const OnDevice &) = delete;
  ~OnDevice() { cuMemFree(address_); }

  /// As the device sees it.
  T *get() const { return reinterpret_cast<T *>(address_); }
  T read() const {
    T value;
    EXPECT_EQ(cuMemcpyDtoHAsync(&value, address_, sizeof(T), nullptr),
              CUDA_SUCCESS);
    return value;
  }

private:
  CUdeviceptr address_ = 0;
};

/// The runtime's own kernels, in the current context.
class Joins {
public:
  Joins() {
    std::ifstream file(PIKO_JOINS_PTX);
    std::string ptx{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(cuModuleLoadDataEx(&module_, ptx.c_str(), 0, nullptr, nullptr),
              CUDA_SUCCESS);
  }
  Joins(const Joins &) = delete;
  Joins &operator=(const Joins &) = delete;
  ~Joins() { cuModuleUnload(module_); }

  /// Launches a grid, and waits for it.
  template <class Args>
  CUresult launch(const char *name, unsigned blocks, const Args &args) const {
    CUfunction kernel;
    EXPECT_EQ(cuModuleGetFunction(&kernel, module_, name), CUDA_SUCCESS);
    OnDevice<Args> told(args);
    const Args *address = told.get();
    void *parameters[] = {&address};
    EXPECT_EQ(cuLaunchCooperativeKernel(kernel, blocks, 1, 1, joinThreads, 1, 1,
                                        0, nullptr, parameters),
              CUDA_SUCCESS);
    return cuStreamSynchronize(nullptr);
  }

private:
  CUmodule module_ = nullptr;
};

class CudaJoins : public Cuda {};

// They are counted over all of a frame, which may be one of very many waves. If
// the count began at 0 again, blocks would wait for a number that has gone by,
// as 2^32 is no multiple of theirs.
TEST_F(CudaJoins, BarriersOfAFrameMayBeMoreThan32BitsCount) {
  constexpr uint64_t blocks = 3, rounds = 5;
  constexpr uint64_t before = (UINT32_MAX / blocks - 2) * blocks;
  HostContext context;
  Joins joins;
  OnDevice<int64_t> progress(0);
  OnDevice<CycleState> cycle({});
  FrameState state{};
  state.mostAlone = -1; // even for nothing, all of them meet
  state.progress = progress.get();
  state.arrived = before;
  OnDevice<FrameState> frame(state);
  StepArgs args{};
  args.frame = frame.get();
  args.cycle = cycle.get();
  for (uint64_t round = 0; round < rounds; ++round)
    ASSERT_EQ(joins.launch("piko_round", blocks, args), CUDA_SUCCESS) << round;
  EXPECT_EQ(cycle.read().rounds, int64_t(rounds));
  EXPECT_EQ(frame.read().arrived, before + rounds * blocks);
}

constexpr int32_t clearValue = 42;

/// As that of Scale; no unit has a part of a bin.
void setupClears(pikort_pipeline *p) {
  pikoir_cuda_module(p, ScaleProgram::images.data());
  ScaleProgram::declareSteps(p);
  pikoir_declare_pipeline(p, "Clears", 1);
  pikoir_declare_record(p, 0, "int", 4, 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_state(p, 0, "factor", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "out", PIKORT_BUFFER, 0, 1, -1, nullptr);
  pikoir_declare_state(p, 2, "picture", PIKORT_IMAGE, 0, 1, -1, &clearValue);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "scaler", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_ORDERED, 0);
  pikoir_declare_clears(p, 0, 2);
  pikoir_declare_source(p, 0, 0);
}

// No unit does it, as there is nothing to scale. The first block ends the join,
// while others have only come to its last barrier: they have asked before
// whether it is the stage's first.
TEST_F(CudaJoins, BlocksThatAreLateClearAsWell) {
  static const pikort_program program{PIKORT_ABI_VERSION, "Clears", setupClears,
                                      ScaleProgram::program.run};
  numbers.clear();
  Pipeline pipe{program};
  ASSERT_TRUE(pipe.created()) << pipe.created().message();
  ASSERT_TRUE(bind(pipe));
  constexpr int32_t pixels = 20000; // more than one block would clear alone
  ASSERT_TRUE(pipe.domain({pixels}));
  auto status = pipe.run();
  ASSERT_TRUE(status) << status.message();
  PikoTestDriverCounts counts;
  ASSERT_EQ(pikoTestDriverCounts("piko_join", &counts), 0);
  EXPECT_GT(counts.blocks, 1u);
  auto picture = pipe.view<int32_t>("picture");
  int32_t clear = 0;
  for (int32_t x = 0; x < pixels; ++x)
    clear += picture(x) == clearValue;
  EXPECT_EQ(clear, pixels);
}

} // namespace
