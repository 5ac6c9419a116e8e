// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Submission.cpp - Steps of a frame on a device ----------------------===//

#include "cuda/Submission.h"
#include "cuda/Accelerator.h"

#include <algorithm>

using namespace piko::cuda;

const Driver &Submission::driver() const {
  return accelerator_.device_->driver;
}

void Submission::check(CUresult result) {
  accelerator_.device_->check(result, "making a graph of a frame");
}

static bool repeats(std::span<const Step> steps) {
  return std::any_of(steps.begin(), steps.end(), [](const Step &step) {
    return step.kind == Step::Kind::Repeat;
  });
}

/// How many bodies are one in another.
static size_t depthOf(std::span<const Step> steps) {
  size_t depth = 0, most = 0;
  for (const Step &step : steps) {
    depth += step.kind == Step::Kind::Repeat;
    most = std::max(most, depth);
    depth -= step.kind == Step::Kind::End;
  }
  return most;
}

bool Submission::canBeGraph(std::span<const Step> steps) const {
  const Driver &d = driver();
  bool hasGraphs = d.cuGraphInstantiateWithFlags && d.cuGraphExecUpdate;
  bool hasConditions = d.cuGraphConditionalHandleCreate && d.cuGraphAddNode &&
                       d.cuStreamGetCaptureInfo &&
                       d.cuStreamUpdateCaptureDependencies &&
                       d.cuStreamBeginCaptureToGraph;
  return steps.size() > 1 && hasGraphs &&
         ((hasConditions && !refusesConditions_) || !repeats(steps));
}

bool Submission::tryGraph(std::span<const Step> steps) {
  if (timesKernels_ || !canBeGraph(steps))
    return false;
  try {
    makeGraph(steps);
    accelerator_.device_->check(
        driver().cuGraphLaunch(graph_, accelerator_.stream_),
        "running a frame");
  } catch (const piko::rt::Failure &failure) {
    // Under MPS no body has cooperative grids, and nothing says which call
    // refuses them, nor how.
    if (!repeats(steps) || accelerator_.device_->isLost() ||
        failure.code != PIKORT_DEVICE_FAILED)
      throw;
    dropGraph();
    return false;
  }
  return true;
}

void Submission::run(std::span<const Step> steps) {
  timesKernels_ = accelerator_.p_.timesKernels;
  if (tryGraph(steps))
    return;
  bool wasRefused = !timesKernels_ && canBeGraph(steps);
  beginTimes();
  runOneByOne(steps);
  // The same steps have gone well: it was the graph that did not.
  refusesConditions_ |= wasRefused;
}

void Submission::beginTimes() {
  if (timesKernels_)
    times_.begin(accelerator_.stream_);
}

void Submission::addTimes() {
  if (timesKernels_)
    times_.add(accelerator_.p_.kernelStats);
}

void Submission::end() noexcept {
  times_.end();
  dropGraph();
  for (CUstream stream : bodyStreams_)
    driver().cuStreamDestroy(stream);
  bodyStreams_.clear();
}

std::span<const Step> Submission::bodyOf(std::span<const Step> steps) {
  size_t depth = 1, end = 1;
  for (; depth > 0; ++end)
    depth += steps[end].kind == Step::Kind::Repeat
                 ? 1
                 : -static_cast<size_t>(steps[end].kind == Step::Kind::End);
  return steps.subspan(1, end - 2);
}

void Submission::runOneByOne(std::span<const Step> steps) {
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].kind == Step::Kind::Grid) {
      accelerator_.launch(steps[i].grid, accelerator_.stream_);
      if (timesKernels_)
        times_.note(accelerator_.stream_, steps[i].timed, steps[i].grid.isJoin);
      continue;
    }
    std::span<const Step> body = bodyOf(steps.subspan(i));
    do {
      runOneByOne(body);
      accelerator_.wait(steps);
      addTimes();
      beginTimes();
    } while (accelerator_.read(steps[i].again) != 0);
    i += body.size() + 1;
  }
}

// --- Graphs -----------------------------------------------------------------

void Submission::dropGraph() noexcept {
  if (graph_)
    driver().cuGraphExecDestroy(std::exchange(graph_, nullptr));
}

void Submission::makeGraph(std::span<const Step> steps) {
  if (graph_ && std::ranges::equal(steps, steps_))
    return;
  if (repeats(steps)) // a capture refuses to load it
    accelerator_.find(conditionKernel);
  CUgraph graph = capture(steps);
  CUgraphExecUpdateResultInfo info{};
  // Handles of conditions are not among what can be changed.
  bool changes =
      graph_ && !repeats(steps) &&
      driver().cuGraphExecUpdate(graph_, graph, &info) == CUDA_SUCCESS;
  CUresult result = CUDA_SUCCESS;
  if (!changes) {
    dropGraph();
    result = driver().cuGraphInstantiateWithFlags(&graph_, graph, /*flags=*/0);
  }
  driver().cuGraphDestroy(graph);
  check(result);
  steps_.assign(steps.begin(), steps.end());
}

CUgraph Submission::capture(std::span<const Step> steps) {
  CUstream stream = accelerator_.own_;
  streamOf(depthOf(steps)); // a capture refuses to make them
  // Other threads may do with the device what they like meanwhile.
  accelerator_.device_->check(driver().cuStreamBeginCapture(
                                  stream, CU_STREAM_CAPTURE_MODE_THREAD_LOCAL),
                              "capturing a frame");
  CUgraph graph = nullptr;
  try {
    addSteps(steps, 0);
  } catch (...) {
    for (; captured_ > 0; --captured_) // their graphs are the whole one's
      driver().cuStreamEndCapture(bodyStreams_[captured_ - 1], &graph);
    if (endCapture(stream, graph) == CUDA_SUCCESS)
      driver().cuGraphDestroy(graph);
    throw;
  }
  accelerator_.device_->check(endCapture(stream, graph), "capturing a frame");
  return graph;
}

CUresult Submission::endCapture(CUstream stream, CUgraph &graph) const {
  CUresult result = driver().cuStreamEndCapture(stream, &graph);
  CUgraph other = nullptr;
  if (result != CUDA_SUCCESS && // it may not have ended
      driver().cuStreamEndCapture(stream, &other) == CUDA_SUCCESS)
    driver().cuGraphDestroy(other);
  return result;
}

CUstream Submission::streamOf(size_t depth) {
  if (depth == 0)
    return accelerator_.own_;
  while (bodyStreams_.size() < depth) {
    CUstream stream = nullptr;
    accelerator_.device_->check(
        driver().cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING),
        "creating a stream");
    bodyStreams_.push_back(stream);
  }
  return bodyStreams_[depth - 1];
}

void Submission::addSteps(std::span<const Step> steps, size_t depth) {
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].kind == Step::Kind::Grid) {
      accelerator_.launch(steps[i].grid, streamOf(depth));
      continue;
    }
    std::span<const Step> body = bodyOf(steps.subspan(i));
    addRepeat(body, steps[i].again, depth);
    i += body.size() + 1;
  }
}

void Submission::setCondition(CUgraphConditionalHandle handle,
                              const int32_t *again, size_t depth) {
  accelerator_.launch(
      {conditionKernel,
       1,
       1,
       {static_cast<int64_t>(handle), reinterpret_cast<int64_t>(again)},
       /*isJoin=*/false},
      streamOf(depth));
}

void Submission::addRepeat(std::span<const Step> body, const int32_t *again,
                           size_t depth) {
  CUstream stream = streamOf(depth), inner = streamOf(depth + 1);
  CUstreamCaptureStatus status{};
  CUgraph graph = nullptr;
  const CUgraphNode *last = nullptr;
  size_t lastCount = 0;
  auto findGraph = [&] {
    check(driver().cuStreamGetCaptureInfo(stream, &status, nullptr, &graph,
                                          &last, &lastCount));
  };
  findGraph();
  // That of all nodes of the body.
  CUcontext context = accelerator_.device_->context();
  CUgraphConditionalHandle handle = 0;
  check(driver().cuGraphConditionalHandleCreate(&handle, graph, context,
                                                /*value=*/0, /*flags=*/0));
  setCondition(handle, again, depth);
  findGraph();
  CUgraphNodeParams parameters{};
  parameters.type = CU_GRAPH_NODE_TYPE_CONDITIONAL;
  parameters.conditional.handle = handle;
  parameters.conditional.type = CU_GRAPH_COND_TYPE_WHILE;
  parameters.conditional.size = 1;
  parameters.conditional.ctx = context;
  CUgraphNode node = nullptr;
  check(driver().cuGraphAddNode(&node, graph, last, nullptr, lastCount,
                                &parameters));
  check(driver().cuStreamUpdateCaptureDependencies(
      stream, &node, 1, CU_STREAM_SET_CAPTURE_DEPENDENCIES));
  check(driver().cuStreamBeginCaptureToGraph(
      inner, parameters.conditional.phGraph_out[0], nullptr, nullptr, 0,
      CU_STREAM_CAPTURE_MODE_THREAD_LOCAL));
  ++captured_;
  addSteps(body, depth + 1);
  setCondition(handle, again, depth + 1);
  check(driver().cuStreamEndCapture(inner, &graph));
  --captured_;
}
