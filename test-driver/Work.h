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

namespace piko::ptx {
class Conditions;
}

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

struct Node;

/// In the order of their capture, in which they run.
using Nodes = std::vector<Node>;

struct Conditional {
  CUgraphConditionalHandle handle = 0;
  CUgraphConditionalNodeType type = CU_GRAPH_COND_TYPE_IF;
  std::vector<CUgraph> graphs; ///< Its bodies.
  std::vector<Nodes> bodies{}; ///< What is in them, of an executable graph.
};

using Work = std::variant<Kernel, Copy, Fill, Conditional>;

struct Node {
  CUgraphNode handle = nullptr;
  Work work;
};

/// What is wrong with memory that work uses; empty if nothing.
std::string checkMemory(const Context &context, const Work &work);
std::string checkMemory(const Context &context, uint64_t address,
                        uint64_t bytes);

/// Runs work whose memory is there. A kernel that fails is the error of later
/// calls.
void run(const Call &call, const Work &work,
         ptx::Conditions *conditions = nullptr);

/// Runs it or, on a stream that is captured, keeps it.
CUresult submit(const Call &call, CUstream stream, Work work);

} // namespace piko::testdriver

#endif // PIKO_TEST_DRIVER_WORK_H
