// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- LaunchCalls.cpp - Launches of the driver for tests -----------------===//

#include "State.h"

#include <cstring>
#include <utility>

using namespace piko::testdriver;
using namespace piko::cuda;
namespace ptx = piko::ptx;

namespace {

constexpr uint32_t mostThreads = 1024, mostShared = 48 << 10,
                   mostBlocksX = 0x7fffffff, mostBlocksYZ = 65535;

/// What is wrong with the sizes of a launch; empty if nothing.
std::string check(const ptx::Program &program,
                  const std::array<uint32_t, 3> &blocks,
                  const std::array<uint32_t, 3> &threads, uint32_t shared) {
  uint64_t count = uint64_t(threads[0]) * threads[1] * threads[2];
  if (!count || count > mostThreads || threads[2] > 64)
    return std::to_string(count) + " threads in a block";
  if (!blocks[0] || !blocks[1] || !blocks[2] || blocks[0] > mostBlocksX ||
      blocks[1] > mostBlocksYZ || blocks[2] > mostBlocksYZ)
    return "a number of blocks";
  const auto &most = program.maxThreads, &required = program.requiredThreads;
  if (most[0] && count > uint64_t(most[0]) * most[1] * most[2])
    return std::to_string(count) + " threads, more than .maxntid of '" +
           program.name + "'";
  if (required[0] && threads != required)
    return "other threads than .reqntid of '" + program.name + "'";
  if (uint64_t(program.sharedBytes) + shared > mostShared)
    return "more than " + std::to_string(mostShared) +
           " bytes of shared memory";
  return {};
}

/// The program's parameters, out of what they are at now; empty text if all
/// are there.
std::string take(void **from, const ptx::Program &program,
                 std::vector<uint8_t> &parameters) {
  parameters.resize(program.parameterBytes);
  for (size_t i = 0; i < program.parameters.size(); ++i) {
    if (!from || !from[i])
      return "no parameter " + std::to_string(i);
    std::memcpy(&parameters[program.parameters[i].offset], from[i],
                program.parameters[i].size);
  }
  return {};
}

/// Checks a launch and takes its parameters.
CUresult prepare(const Call &call, Kernel &kernel, void **parameters) {
  auto found = call.context().functions.find(kernel.function);
  if (found == call.context().functions.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no function of a module");
  const ptx::Program &program = found->second.program;
  std::string wrong =
      check(program, kernel.blocks, kernel.threads, kernel.sharedBytes);
  if (wrong.empty())
    wrong = take(parameters, program, kernel.parameters);
  if (!wrong.empty())
    return call.fail(CUDA_ERROR_INVALID_VALUE, wrong);
  if (!kernel.cooperative)
    return CUDA_SUCCESS;
  const auto &blocks = kernel.blocks, &threads = kernel.threads;
  const uint64_t count = uint64_t(blocks[0]) * blocks[1] * blocks[2];
  const int most =
      state().multiprocessors *
      residentBlocks(program,
                     static_cast<int>(threads[0] * threads[1] * threads[2]),
                     kernel.sharedBytes);
  if (count > static_cast<uint64_t>(most))
    return call.fail(CUDA_ERROR_COOPERATIVE_LAUNCH_TOO_LARGE,
                     std::to_string(count) + " blocks, and " +
                         std::to_string(most) + " run at the same time");
  return CUDA_SUCCESS;
}

/// A function may be loaded by its first launch, which a capture forbids.
CUresult load(const Call &call, CUfunction handle, CUstream stream) {
  Function &function = call.context().functions.find(handle)->second;
  if (state().modes.lazy && !function.loaded &&
      call.context().captureOf(stream))
    return call.fail(CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED,
                     "'" + function.program.name +
                         "' would be loaded, and its stream is captured");
  function.loaded = true;
  return CUDA_SUCCESS;
}

CUresult launchKernel(const Call &call, Kernel kernel, CUstream stream,
                      void **parameters) {
  CUresult error = prepare(call, kernel, parameters);
  if (!error)
    error = load(call, kernel.function, stream);
  return error ? error : submit(call, stream, std::move(kernel));
}

} // namespace

CUresult piko::cuda::cuLaunchKernel(CUfunction function, unsigned gridX,
                                    unsigned gridY, unsigned gridZ,
                                    unsigned blockX, unsigned blockY,
                                    unsigned blockZ, unsigned sharedBytes,
                                    CUstream stream, void **parameters,
                                    void **extra) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (extra)
    return call.fail(CUDA_ERROR_NOT_SUPPORTED, "parameters in a buffer");
  return launchKernel(
      call,
      {function, {gridX, gridY, gridZ}, {blockX, blockY, blockZ}, sharedBytes},
      stream, parameters);
}

CUresult piko::cuda::cuLaunchCooperativeKernel(
    CUfunction function, unsigned gridX, unsigned gridY, unsigned gridZ,
    unsigned blockX, unsigned blockY, unsigned blockZ, unsigned sharedBytes,
    CUstream stream, void **parameters) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  return launchKernel(call,
                      {function,
                       {gridX, gridY, gridZ},
                       {blockX, blockY, blockZ},
                       sharedBytes,
                       /*cooperative=*/true},
                      stream, parameters);
}
