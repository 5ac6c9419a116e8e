// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ConditionalNodesTest.cpp - Graphs that a kernel controls -----------===//

#include "test/DriverFixture.h"

using namespace piko::testdriver;

namespace {

/// Kernels know of `memory`: [0] what `step` takes 1 from, [1] how often it
/// ran.
class ConditionalNodesTest : public DriverTest {
protected:
  void SetUp() override {
    DriverTest::SetUp();
    ASSERT_EQ(cuMemAllocManaged(&memory, 64, CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    std::memset(reinterpret_cast<void *>(memory), 0, 64);
    for (CUstream *it : {&stream, &inner})
      ASSERT_EQ(cuStreamCreate(it, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
    ASSERT_NE(load(source, "step"), nullptr);
    step = loadForCapture("step");
    choose = loadForCapture("choose");
  }
  void TearDown() override {
    if (!lost) {
      EXPECT_EQ(cuMemFree(memory), CUDA_SUCCESS);
      for (CUstream it : {stream, inner})
        EXPECT_EQ(cuStreamDestroy(it), CUDA_SUCCESS);
    }
    DriverTest::TearDown();
  }

  /// `choose` sets the condition to [0]; so does `step`, when it has taken 1.
  static constexpr const char *source = R"(
.version 7.8
.target sm_70
.address_size 64
.extern .func cudaGraphSetConditional
(
  .param .b64 cudaGraphSetConditional_param_0,
  .param .b32 cudaGraphSetConditional_param_1
)
;
.func set(.param .b64 set_param_0, .param .b32 set_param_1)
{
  .reg .b32 %r<2>;
  .reg .b64 %rd<2>;
  ld.param.b64 %rd1, [set_param_0];
  ld.param.b32 %r1, [set_param_1];
  {
  .param .b64 param0;
  .param .b32 param1;
  st.param.b64 [param0], %rd1;
  st.param.b32 [param1], %r1;
  call.uni cudaGraphSetConditional, (param0, param1);
  }
  ret;
}
.visible .entry choose(.param .u64 memory, .param .u64 handle)
{
  .reg .b32 %r<4>;
  .reg .b64 %rd<4>;
  ld.param.b64 %rd1, [memory];
  ld.param.b64 %rd2, [handle];
  ld.global.b32 %r1, [%rd1];
  {
  .param .b64 param0;
  .param .b32 param1;
  st.param.b64 [param0], %rd2;
  st.param.b32 [param1], %r1;
  call.uni set, (param0, param1);
  }
  ret;
}
.visible .entry step(.param .u64 memory, .param .u64 handle)
{
  .reg .b32 %r<4>;
  .reg .b64 %rd<4>;
  ld.param.b64 %rd1, [memory];
  ld.param.b64 %rd2, [handle];
  ld.global.b32 %r1, [%rd1];
  sub.s32 %r1, %r1, 1;
  st.global.b32 [%rd1], %r1;
  ld.global.b32 %r2, [%rd1+4];
  add.s32 %r2, %r2, 1;
  st.global.b32 [%rd1+4], %r2;
  {
  .param .b64 param0;
  .param .b32 param1;
  st.param.b64 [param0], %rd2;
  st.param.b32 [param1], %r1;
  call.uni set, (param0, param1);
  }
  ret;
}
)";

  uint32_t &number(size_t i) const {
    return reinterpret_cast<uint32_t *>(memory)[i];
  }
  void launchOn(CUstream on, CUfunction function,
                CUgraphConditionalHandle handle) const {
    uint64_t place = memory, given = handle;
    void *parameters[] = {&place, &given};
    EXPECT_EQ(
        cuLaunchKernel(function, 1, 1, 1, 1, 1, 1, 0, on, parameters, nullptr),
        CUDA_SUCCESS)
        << pikoTestDriverError();
  }
  /// The graph that `stream` is captured into, and the node before the next.
  CUgraph captured(CUgraphNode *last = nullptr) const {
    CUstreamCaptureStatus status{};
    CUgraph graph = nullptr;
    const CUgraphNode *nodes = nullptr;
    size_t count = 0;
    EXPECT_EQ(cuStreamGetCaptureInfo(stream, &status, nullptr, &graph, &nodes,
                                     &count),
              CUDA_SUCCESS);
    if (last)
      *last = count ? *nodes : nullptr;
    return graph;
  }
  CUgraphConditionalHandle makeHandle(uint32_t value, unsigned flags) const {
    CUgraphConditionalHandle handle = 0;
    EXPECT_EQ(cuGraphConditionalHandleCreate(&handle, captured(), nullptr,
                                             value, flags),
              CUDA_SUCCESS)
        << pikoTestDriverError();
    return handle;
  }
  /// Adds a node to what is captured, and fills its bodies by \p fill.
  template <typename F>
  void addNode(CUgraphConditionalHandle handle, CUgraphConditionalNodeType type,
               unsigned size, F fill) {
    CUgraphNode last = nullptr, node = nullptr;
    CUgraph graph = captured(&last);
    CUgraphNodeParams parameters{};
    parameters.type = CU_GRAPH_NODE_TYPE_CONDITIONAL;
    parameters.conditional.handle = handle;
    parameters.conditional.type = type;
    parameters.conditional.size = size;
    ASSERT_EQ(cuGraphAddNode(&node, graph, last ? &last : nullptr, nullptr,
                             last ? 1 : 0, &parameters),
              CUDA_SUCCESS)
        << pikoTestDriverError();
    ASSERT_EQ(cuStreamUpdateCaptureDependencies(
                  stream, &node, 1, CU_STREAM_SET_CAPTURE_DEPENDENCIES),
              CUDA_SUCCESS);
    for (unsigned body = 0; body < size; ++body) {
      CUgraph filled = nullptr;
      ASSERT_EQ(cuStreamBeginCaptureToGraph(
                    inner, parameters.conditional.phGraph_out[body], nullptr,
                    nullptr, 0, CU_STREAM_CAPTURE_MODE_GLOBAL),
                CUDA_SUCCESS);
      fill(body);
      ASSERT_EQ(cuStreamEndCapture(inner, &filled), CUDA_SUCCESS);
      EXPECT_EQ(filled, parameters.conditional.phGraph_out[body]);
    }
  }
  CUgraphExec finish() {
    CUgraph graph = nullptr;
    CUgraphExec executable = nullptr;
    EXPECT_EQ(cuStreamEndCapture(stream, &graph), CUDA_SUCCESS);
    EXPECT_EQ(cuGraphInstantiateWithFlags(&executable, graph, 0), CUDA_SUCCESS);
    EXPECT_EQ(cuGraphDestroy(graph), CUDA_SUCCESS);
    return executable;
  }
  void begin() {
    ASSERT_EQ(cuStreamBeginCapture(stream, CU_STREAM_CAPTURE_MODE_GLOBAL),
              CUDA_SUCCESS);
  }

  CUdeviceptr memory = 0;
  CUstream stream = nullptr, inner = nullptr;
  CUfunction step = nullptr, choose = nullptr;
  bool lost = false;
};

TEST_F(ConditionalNodesTest, AsLongAsTheConditionHolds) {
  begin();
  const auto handle = makeHandle(0, 0);
  launchOn(stream, choose, handle);
  addNode(handle, CU_GRAPH_COND_TYPE_WHILE, 1,
          [&](unsigned) { launchOn(inner, step, handle); });
  // After it.
  EXPECT_EQ(cuMemcpyAsync(memory + 8, memory + 4, 4, stream), CUDA_SUCCESS);
  CUgraphExec executable = finish();
  for (uint32_t rounds : {0, 5, 3}) {
    number(0) = rounds;
    number(1) = 0;
    EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
    EXPECT_EQ(cuStreamSynchronize(stream), CUDA_SUCCESS);
    EXPECT_EQ(number(0), 0u);
    EXPECT_EQ(number(2), rounds);
  }
  PikoTestDriverHostCounts counts{};
  pikoTestDriverHostCounts(&counts);
  EXPECT_EQ(counts.graphKernels, 3u + 8);
  EXPECT_EQ(counts.waits, 3u);
  EXPECT_EQ(cuGraphExecDestroy(executable), CUDA_SUCCESS);
  EXPECT_EQ(std::string(pikoTestDriverAlive()).find("graph"),
            std::string::npos);
}

TEST_F(ConditionalNodesTest, OneOfSeveralBodies) {
  begin();
  const auto given = makeHandle(1, CU_GRAPH_COND_ASSIGN_DEFAULT);
  const auto chosen = makeHandle(0, 0);
  auto fill = [&](unsigned body) {
    EXPECT_EQ(
        cuMemsetD8Async(memory + 4, static_cast<uint8_t>(10 + body), 1, inner),
        CUDA_SUCCESS);
  };
  addNode(given, CU_GRAPH_COND_TYPE_IF, 2, fill);
  EXPECT_EQ(cuMemcpyAsync(memory + 8, memory + 4, 4, stream), CUDA_SUCCESS);
  launchOn(stream, choose, chosen);
  addNode(chosen, CU_GRAPH_COND_TYPE_SWITCH, 3, fill);
  CUgraphExec executable = finish();
  for (uint32_t choice : {2, 0, 3}) {
    number(0) = choice;
    EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
    EXPECT_EQ(number(2), 10u);
    EXPECT_EQ(number(1), choice < 3 ? 10 + choice : 10);
  }
  EXPECT_EQ(cuGraphExecDestroy(executable), CUDA_SUCCESS);
}

TEST_F(ConditionalNodesTest, WhatIsRefused) {
  CUgraphNode node = nullptr;
  CUgraphConditionalHandle handle = 0;
  CUgraphNodeParams parameters{};
  begin();
  CUgraph graph = captured();
  EXPECT_EQ(cuGraphConditionalHandleCreate(&handle, nullptr, nullptr, 0, 0),
            CUDA_ERROR_INVALID_VALUE);
  handle = makeHandle(0, 0);
  auto add = [&](CUgraphConditionalNodeType type, unsigned size) {
    parameters.type = CU_GRAPH_NODE_TYPE_CONDITIONAL;
    parameters.conditional = {handle, type, size, nullptr, nullptr};
    return cuGraphAddNode(&node, graph, nullptr, nullptr, 0, &parameters);
  };
  EXPECT_EQ(add(CU_GRAPH_COND_TYPE_WHILE, 2), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(add(CU_GRAPH_COND_TYPE_IF, 0), CUDA_ERROR_INVALID_VALUE);
  ASSERT_EQ(add(CU_GRAPH_COND_TYPE_IF, 1), CUDA_SUCCESS);
  CUgraph body = parameters.conditional.phGraph_out[0];
  // The handle is taken, and the stream does not know of the node.
  EXPECT_EQ(add(CU_GRAPH_COND_TYPE_IF, 1), CUDA_ERROR_NOT_SUPPORTED);
  EXPECT_EQ(cuGraphAddNode(&node, graph, &node, nullptr, 1, &parameters),
            CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemsetD8Async(memory, 0, 1, stream), CUDA_ERROR_NOT_SUPPORTED);
  EXPECT_EQ(cuGraphDestroy(body), CUDA_ERROR_INVALID_VALUE);
  ASSERT_EQ(cuStreamEndCapture(stream, &graph), CUDA_SUCCESS);
  CUgraphExec executable = nullptr;
  EXPECT_EQ(cuStreamBeginCaptureToGraph(inner, body, nullptr, nullptr, 0,
                                        CU_STREAM_CAPTURE_MODE_GLOBAL),
            CUDA_SUCCESS);
  EXPECT_EQ(cuMemcpyHtoDAsync(memory, &handle, 8, inner), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamEndCapture(inner, &body), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphInstantiateWithFlags(&executable, graph, 0),
            CUDA_ERROR_NOT_SUPPORTED);
  EXPECT_EQ(cuGraphDestroy(graph), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphDestroy(body), CUDA_ERROR_INVALID_VALUE);
}

TEST_F(ConditionalNodesTest, AConditionOfNoGraphIsAFault) {
  expectsLeaks = true;
  launchOn(stream, choose, 16);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_ERROR_ILLEGAL_ADDRESS);
  EXPECT_NE(std::string(pikoTestDriverError())
                .find("no condition of the graph that runs"),
            std::string::npos);
  renewContext();
  lost = true;
}

} // namespace
