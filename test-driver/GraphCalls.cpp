// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GraphCalls.cpp - Graphs of the driver for tests --------------------===//

#include "State.h"

#include <algorithm>
#include <cstring>
#include <utility>

using namespace piko::testdriver;
using namespace piko::cuda;
namespace ptx = piko::ptx;
namespace testdriver = piko::testdriver;

CUgraphNode Graph::add(Work work) {
  auto handle = state().newHandle<CUgraphNode>();
  nodes.push_back({handle, std::move(work)});
  return handle;
}

void Context::destroyGraph(CUgraph graph) {
  auto found = graphs.find(graph);
  for (const Node &node : found->second.nodes)
    if (const auto *conditional = std::get_if<Conditional>(&node.work))
      for (CUgraph body : conditional->graphs)
        destroyGraph(body);
  graphs.erase(found);
}

namespace {

/// What makes an executable node none that can be updated to another.
CUgraphExecUpdateResult difference(const Work &from, const Work &to) {
  if (from.index() != to.index())
    return CU_GRAPH_EXEC_UPDATE_ERROR_NODE_TYPE_CHANGED;
  if (const auto *kernel = std::get_if<Kernel>(&from)) {
    const auto &other = std::get<Kernel>(to);
    if (kernel->function != other.function)
      return CU_GRAPH_EXEC_UPDATE_ERROR_FUNCTION_CHANGED;
    if (kernel->cooperative != other.cooperative)
      return CU_GRAPH_EXEC_UPDATE_ERROR_ATTRIBUTES_CHANGED;
  }
  if (std::holds_alternative<Conditional>(from))
    return CU_GRAPH_EXEC_UPDATE_ERROR_NOT_SUPPORTED;
  if (const auto *copy = std::get_if<Copy>(&from))
    if (copy->direction != std::get<Copy>(to).direction)
      return CU_GRAPH_EXEC_UPDATE_ERROR_PARAMETERS_CHANGED;
  return CU_GRAPH_EXEC_UPDATE_SUCCESS;
}

CUgraphExecUpdateResultInfo compare(const Nodes &from, const Nodes &to) {
  if (from.size() != to.size())
    return {CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED, nullptr, nullptr};
  for (size_t i = 0; i < from.size(); ++i)
    if (auto result = difference(from[i].work, to[i].work))
      return {result, to[i].handle, nullptr};
  return {CU_GRAPH_EXEC_UPDATE_SUCCESS, nullptr, nullptr};
}

const char *textOf(CUgraphExecUpdateResult result) {
  switch (result) {
  case CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED:
    return "another number of nodes";
  case CU_GRAPH_EXEC_UPDATE_ERROR_NODE_TYPE_CHANGED:
    return "another type of a node";
  case CU_GRAPH_EXEC_UPDATE_ERROR_FUNCTION_CHANGED:
    return "another function of a kernel";
  case CU_GRAPH_EXEC_UPDATE_ERROR_ATTRIBUTES_CHANGED:
    return "a kernel that is cooperative, and one that is not";
  case CU_GRAPH_EXEC_UPDATE_ERROR_NOT_SUPPORTED:
    return "a conditional node";
  default:
    return "another direction of a copy";
  }
}

/// Rounds of a conditional node's body until a launch is given up.
constexpr uint32_t patience = 1000000;

class GraphRun : ptx::Conditions {
public:
  explicit GraphRun(const Call &call) : call(call), context(call.context()) {}

  /// False where one has failed, which later calls return.
  bool run(const Nodes &nodes) {
    return std::all_of(nodes.begin(), nodes.end(),
                       [&](const Node &node) { return run(node.work); });
  }

private:
  bool run(const Work &work);
  bool run(const Conditional &node);
  bool fail(CUresult error, const std::string &text) {
    context.failed = call.fail(error, text);
    return false;
  }
  bool set(uint64_t handle, uint32_t value) override {
    auto found = context.conditions.find(handle);
    if (found == context.conditions.end())
      return false;
    found->second.value = value;
    return true;
  }

  const Call &call;
  Context &context;
};

bool GraphRun::run(const Work &work) {
  if (const auto *conditional = std::get_if<Conditional>(&work))
    return run(*conditional);
  if (const auto *kernel = std::get_if<Kernel>(&work)) {
    if (!context.functions.contains(kernel->function))
      return fail(CUDA_ERROR_LAUNCH_FAILED, "a kernel that was unloaded");
    ++state().hostCounts.graphKernels;
  }
  if (std::string wrong = checkMemory(context, work); !wrong.empty())
    return fail(CUDA_ERROR_ILLEGAL_ADDRESS, wrong);
  testdriver::run(call, work, this);
  return context.failed == CUDA_SUCCESS;
}

bool GraphRun::run(const Conditional &node) {
  const uint32_t &value = context.conditions[node.handle].value;
  if (node.type == CU_GRAPH_COND_TYPE_WHILE) {
    for (uint32_t round = 0; value; ++round) {
      if (round == patience)
        return fail(CUDA_ERROR_LAUNCH_TIMEOUT,
                    "a conditional node that does not end");
      if (!run(node.bodies[0]))
        return false;
    }
    return true;
  }
  const size_t body =
      node.type == CU_GRAPH_COND_TYPE_SWITCH ? value : (value ? 0 : 1);
  return body >= node.bodies.size() || run(node.bodies[body]);
}

/// Gives conditional nodes what is in their bodies, in which nothing may be of
/// the host; false if something is.
bool takeBodies(const Context &context, Nodes &nodes, bool isBody) {
  for (Node &node : nodes) {
    if (const auto *copy = std::get_if<Copy>(&node.work))
      if (isBody && copy->direction != Direction::OnDevice)
        return false;
    auto *conditional = std::get_if<Conditional>(&node.work);
    if (!conditional)
      continue;
    for (CUgraph graph : conditional->graphs) {
      conditional->bodies.push_back(context.graphs.find(graph)->second.nodes);
      if (!takeBodies(context, conditional->bodies.back(), true))
        return false;
    }
  }
  return true;
}

} // namespace

CUresult piko::cuda::cuGraphInstantiateWithFlags(CUgraphExec *executable,
                                                 CUgraph graph,
                                                 unsigned long long flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().graphs.find(graph);
  if (!executable || flags)
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  if (found == call.context().graphs.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  Executable made{graph, found->second.nodes};
  if (!takeBodies(call.context(), made.nodes, false))
    return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                     "a copy of the host's memory in a conditional node");
  *executable = state().newHandle<CUgraphExec>();
  call.context().executables[*executable] = std::move(made);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphExecUpdate(CUgraphExec executable, CUgraph graph,
                                       CUgraphExecUpdateResultInfo *info) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto from = call.context().executables.find(executable);
  auto to = call.context().graphs.find(graph);
  if (!info || from == call.context().executables.end() ||
      to == call.context().graphs.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  *info = compare(from->second.nodes, to->second.nodes);
  if (info->result)
    return call.fail(CUDA_ERROR_GRAPH_EXEC_UPDATE_FAILURE,
                     textOf(info->result));
  from->second = {graph, to->second.nodes};
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphLaunch(CUgraphExec executable, CUstream stream) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().executables.find(executable);
  if (found == call.context().executables.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live executable graph");
  if (CUresult error = call.checkStream(stream))
    return error;
  if (call.context().captureOf(stream))
    return call.fail(CUDA_ERROR_NOT_SUPPORTED, "a graph within a graph");
  ++state().hostCounts.graphLaunches;
  auto launch = [made = found->second](const Call &at) {
    for (auto &[handle, condition] : at.context().conditions)
      if (condition.isAssigned && condition.graph == made.graph)
        condition.value = condition.initial;
    ptx::Footprint footprint;
    state().graphFootprint = &footprint;
    GraphRun(at).run(made.nodes);
    state().graphFootprint = nullptr;
    state().hostCounts.graphSectors += footprint.sectors();
  };
  if (state().delays)
    call.context().laterOf(stream).push_back(std::move(launch));
  else
    launch(call);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphExecDestroy(CUgraphExec executable) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!call.context().executables.erase(executable))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live executable graph");
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuGraphDestroy(CUgraph graph) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().graphs.find(graph);
  if (found == call.context().graphs.end() || found->second.isBody)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  call.context().destroyGraph(graph);
  return CUDA_SUCCESS;
}

// --- Conditional nodes -------------------------------------------------------

CUresult
piko::cuda::cuGraphConditionalHandleCreate(CUgraphConditionalHandle *handle,
                                           CUgraph graph, CUcontext context,
                                           unsigned value, unsigned flags) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!handle || flags > CU_GRAPH_COND_ASSIGN_DEFAULT ||
      (context && context != call.context().handle))
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     "flags " + std::to_string(flags));
  if (!call.context().graphs.contains(graph))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  *handle = reinterpret_cast<uint64_t>(state().newHandle<void *>());
  Condition &made = call.context().conditions[*handle];
  made.graph = graph;
  made.isAssigned = flags & CU_GRAPH_COND_ASSIGN_DEFAULT;
  made.initial = value;
  std::memset(&made.value, ptx::unwritten, sizeof(made.value));
  return CUDA_SUCCESS;
}

/// What is wrong with a conditional node; empty if nothing.
static std::string check(const Context &context, CUgraph graph,
                         const CUDA_CONDITIONAL_NODE_PARAMS &given) {
  auto found = context.conditions.find(given.handle);
  if (found == context.conditions.end())
    return "no handle of a condition";
  if (found->second.isUsed)
    return "a handle that another node has";
  if (found->second.graph != graph && !context.graphs.at(graph).isBody)
    return "a handle of another graph";
  if (given.ctx && given.ctx != context.handle)
    return "another context";
  const unsigned most = given.type == CU_GRAPH_COND_TYPE_WHILE ? 1
                        : given.type == CU_GRAPH_COND_TYPE_IF  ? 2
                                                               : ~0u;
  return given.size && given.size <= most
             ? std::string()
             : std::to_string(given.size) + " bodies";
}

CUresult piko::cuda::cuGraphAddNode(CUgraphNode *node, CUgraph graph,
                                    const CUgraphNode *dependencies,
                                    const CUgraphEdgeData *edges, size_t count,
                                    CUgraphNodeParams *parameters) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  Context &context = call.context();
  auto found = context.graphs.find(graph);
  if (!node || !parameters || (count && !dependencies) ||
      found == context.graphs.end())
    return call.fail(CUDA_ERROR_INVALID_VALUE, "no live graph");
  if (parameters->type != CU_GRAPH_NODE_TYPE_CONDITIONAL)
    return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                     "a node that is not conditional");
  if (edges || count > 1 ||
      (count ? *dependencies : nullptr) != found->second.last())
    return call.fail(CUDA_ERROR_NOT_SUPPORTED,
                     "nodes that do not follow each other");
  CUDA_CONDITIONAL_NODE_PARAMS &given = parameters->conditional;
  if (std::string wrong = check(context, graph, given); !wrong.empty())
    return call.fail(CUDA_ERROR_INVALID_VALUE, wrong);
  context.conditions[given.handle].isUsed = true;
  Conditional made{given.handle, given.type, {}};
  for (unsigned body = 0; body < given.size; ++body) {
    made.graphs.push_back(state().newHandle<CUgraph>());
    context.graphs[made.graphs.back()].isBody = true;
  }
  *node = found->second.add(std::move(made));
  given.phGraph_out =
      std::get<Conditional>(found->second.nodes.back().work).graphs.data();
  return CUDA_SUCCESS;
}
