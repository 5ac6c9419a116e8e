// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Work.h - What streams do -------------------------------------------===//
//
// A call on a stream makes a piece of work, which runs at once, or becomes a
// node of a graph if the stream is captured.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_WORK_H
#define PIKO_TEST_DRIVER_WORK_H

#include "Symbols.h"

#include <array>
#include <string>
#include <variant>
#include <vector>

namespace piko::testdriver {

using namespace piko::cuda;

struct Context;
class Call;

/// A launch, with its parameters as they were at the call.
struct Kernel {
  CUfunction function = nullptr;
  std::array<uint32_t, 3> blocks{}, threads{};
  uint32_t sharedBytes = 0;
  bool cooperative = false;
  std::vector<uint8_t> parameters{};
};

enum class Direction : uint8_t { OnDevice, ToDevice, FromDevice };

struct Copy {
  Direction direction = Direction::OnDevice;
  uint64_t to = 0, from = 0, bytes = 0;
};

struct Fill {
  uint64_t address = 0, bytes = 0;
  uint8_t value = 0;
};

using Work = std::variant<Kernel, Copy, Fill>;

struct Node {
  CUgraphNode handle = nullptr;
  Work work;
};

/// In the order of their capture, in which they run.
using Nodes = std::vector<Node>;

/// What is wrong with memory that work uses; empty if nothing.
std::string checkMemory(const Context &context, const Work &work);
std::string checkMemory(const Context &context, uint64_t address,
                        uint64_t bytes);

/// Runs work whose memory is there. A kernel that fails is the error of later
/// calls.
void run(const Call &call, const Work &work);

/// Runs it or, on a stream that is captured, keeps it.
CUresult submit(const Call &call, CUstream stream, Work work);

} // namespace piko::testdriver

#endif // PIKO_TEST_DRIVER_WORK_H
