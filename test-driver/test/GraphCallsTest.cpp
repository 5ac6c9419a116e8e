// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- GraphCallsTest.cpp - Captures and graphs ---------------------------===//

#include "test/DriverFixture.h"

#include <functional>
#include <thread>

using namespace piko::testdriver;

namespace {

class GraphCallsTest : public DriverTest {
protected:
  void SetUp() override {
    DriverTest::SetUp();
    ASSERT_EQ(cuMemAllocManaged(&memory, 4096, CU_MEM_ATTACH_GLOBAL),
              CUDA_SUCCESS);
    std::memset(reinterpret_cast<void *>(memory), 0, 4096);
    ASSERT_EQ(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), CUDA_SUCCESS);
    // Kernels that add [in], and twice that, to [out].
    ASSERT_NE(load(adding("k", 1) + adding("twice", 2)), nullptr);
    once = loadForCapture("k");
    twice = loadForCapture("twice");
  }
  void TearDown() override {
    if (!lost) {
      EXPECT_EQ(cuMemFree(memory), CUDA_SUCCESS);
      EXPECT_EQ(cuStreamDestroy(stream), CUDA_SUCCESS);
    }
    DriverTest::TearDown();
  }

  static std::string adding(const std::string &name, int factor) {
    return std::string(name == "k" ? ".version 7.8 .target sm_70 "
                                     ".address_size 64\n"
                                   : "") +
           ".visible .entry " + name + R"((.param .u64 in, .param .u64 out)
{
  .reg .b64 %rd<8>;
  ld.param.b64 %rd1, [in];
  ld.param.b64 %rd2, [out];
  ld.global.b64 %rd3, [%rd1];
  ld.global.b64 %rd4, [%rd2];
  mad.lo.s64 %rd5, %rd3, )" +
           std::to_string(factor) + R"(, %rd4;
  st.global.b64 [%rd2], %rd5;
  ret;
}
)";
  }

  uint64_t &number(size_t i) const {
    return reinterpret_cast<uint64_t *>(memory)[i];
  }
  CUdeviceptr at(size_t i) const { return memory + i * sizeof(uint64_t); }

  /// Adds number \p from to number \p to.
  CUresult add(CUfunction function, size_t from, size_t to,
               bool together = false) {
    uint64_t in = at(from), out = at(to);
    void *parameters[] = {&in, &out};
    return together ? cuLaunchCooperativeKernel(function, 1, 1, 1, 1, 1, 1, 0,
                                                stream, parameters)
                    : cuLaunchKernel(function, 1, 1, 1, 1, 1, 1, 0, stream,
                                     parameters, nullptr);
  }
  void begin(CUstreamCaptureMode mode = CU_STREAM_CAPTURE_MODE_GLOBAL) {
    ASSERT_EQ(cuStreamBeginCapture(stream, mode), CUDA_SUCCESS)
        << pikoTestDriverError();
  }
  CUgraph end(CUresult expected = CUDA_SUCCESS) {
    CUgraph graph = nullptr;
    EXPECT_EQ(cuStreamEndCapture(stream, &graph), expected)
        << pikoTestDriverError();
    return graph;
  }
  static CUgraphExec instantiate(CUgraph graph) {
    CUgraphExec executable = nullptr;
    EXPECT_EQ(cuGraphInstantiateWithFlags(&executable, graph, 0), CUDA_SUCCESS);
    return executable;
  }
  CUstreamCaptureStatus status() const {
    CUstreamCaptureStatus status = CU_STREAM_CAPTURE_STATUS_NONE;
    EXPECT_EQ(cuStreamIsCapturing(stream, &status), CUDA_SUCCESS);
    return status;
  }
  /// What updating \p executable to \p graph gives, which it destroys.
  CUgraphExecUpdateResult update(CUgraphExec executable, CUgraph graph) {
    CUgraphExecUpdateResultInfo info{};
    CUresult result = cuGraphExecUpdate(executable, graph, &info);
    EXPECT_EQ(result, info.result ? CUDA_ERROR_GRAPH_EXEC_UPDATE_FAILURE
                                  : CUDA_SUCCESS);
    EXPECT_EQ(info.errorNode != nullptr,
              info.result > CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED);
    EXPECT_EQ(cuGraphDestroy(graph), CUDA_SUCCESS);
    return info.result;
  }

  CUdeviceptr memory = 0;
  CUstream stream = nullptr;
  CUfunction once = nullptr, twice = nullptr;
  bool lost = false;
};

TEST_F(GraphCallsTest, NodesRunInTheirOrderAtEachLaunch) {
  const uint64_t given = 5;
  begin();
  EXPECT_EQ(status(), CU_STREAM_CAPTURE_STATUS_ACTIVE);
  EXPECT_EQ(cuMemcpyHtoDAsync(at(0), &given, 8, stream), CUDA_SUCCESS);
  EXPECT_EQ(add(once, 0, 1), CUDA_SUCCESS);
  EXPECT_EQ(add(twice, 1, 2, true), CUDA_SUCCESS);
  EXPECT_EQ(cuMemcpyAsync(at(3), at(2), 8, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuMemsetD8Async(at(2), 0, 8, stream), CUDA_SUCCESS);
  CUgraph graph = end();
  EXPECT_EQ(status(), CU_STREAM_CAPTURE_STATUS_NONE);
  EXPECT_EQ(number(1), 0u); // Nothing has run.
  CUgraphExec executable = instantiate(graph);
  EXPECT_EQ(cuGraphDestroy(graph), CUDA_SUCCESS);
  EXPECT_STREQ(pikoTestDriverAlive(),
               "4096 bytes of managed memory\nmodule k twice\n1 streams\n"
               "1 executable graphs\n");

  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphLaunch(executable, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_SUCCESS);
  EXPECT_EQ(number(1), 10u);
  EXPECT_EQ(number(2), 0u);
  EXPECT_EQ(number(3), 20u);
  EXPECT_EQ(cuGraphExecDestroy(executable), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuGraphExecDestroy(executable), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuGraphDestroy(graph), CUDA_ERROR_INVALID_VALUE);
}

TEST_F(GraphCallsTest, UpdatesChangeParametersAlone) {
  auto captured = [&](auto work) {
    begin();
    work();
    return end();
  };
  number(0) = 3;
  number(1) = 4;
  CUgraph first = captured([&] { add(once, 0, 8); });
  CUgraphExec executable = instantiate(first);
  EXPECT_EQ(cuGraphDestroy(first), CUDA_SUCCESS);
  EXPECT_EQ(update(executable, captured([&] { add(once, 1, 9); })),
            CU_GRAPH_EXEC_UPDATE_SUCCESS);
  EXPECT_EQ(update(executable, captured([&] { add(twice, 0, 8); })),
            CU_GRAPH_EXEC_UPDATE_ERROR_FUNCTION_CHANGED);
  EXPECT_EQ(update(executable, captured([&] { add(once, 0, 8, true); })),
            CU_GRAPH_EXEC_UPDATE_ERROR_ATTRIBUTES_CHANGED);
  EXPECT_EQ(update(executable,
                   captured([&] { cuMemsetD8Async(at(8), 0, 8, stream); })),
            CU_GRAPH_EXEC_UPDATE_ERROR_NODE_TYPE_CHANGED);
  EXPECT_EQ(update(executable, captured([&] {
                     add(once, 0, 8);
                     add(once, 0, 8);
                   })),
            CU_GRAPH_EXEC_UPDATE_ERROR_TOPOLOGY_CHANGED);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
  EXPECT_EQ(number(8), 0u);
  EXPECT_EQ(number(9), 4u);
  EXPECT_EQ(cuGraphExecDestroy(executable), CUDA_SUCCESS);
}

TEST_F(GraphCallsTest, WhatACaptureForbidsMakesItInvalid) {
  CUdeviceptr other = 0;
  CUevent event = nullptr;
  ASSERT_EQ(cuEventCreate(&event, 0), CUDA_SUCCESS);
  const std::pair<const char *, std::function<CUresult()>> calls[] = {
      {"synchronize", [&] { return cuStreamSynchronize(stream); }},
      {"context", [&] { return cuCtxSynchronize(); }},
      {"allocate", [&] { return cuMemAlloc(&other, 8); }},
      {"free", [&] { return cuMemFree(memory); }},
      {"unload", [&] { return cuModuleUnload(module); }},
      {"prefetch", [&] { return cuMemPrefetchAsync(memory, 8, 0, stream); }}};
  for (const auto &[name, call] : calls) {
    begin();
    EXPECT_EQ(add(once, 0, 1), CUDA_SUCCESS);
    EXPECT_EQ(call(), CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED) << name;
    EXPECT_EQ(status(), CU_STREAM_CAPTURE_STATUS_INVALIDATED) << name;
    EXPECT_EQ(add(once, 0, 1), CUDA_ERROR_STREAM_CAPTURE_INVALIDATED) << name;
    EXPECT_EQ(end(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED), nullptr) << name;
    EXPECT_EQ(cuStreamSynchronize(stream), CUDA_SUCCESS) << name;
  }
  begin();
  EXPECT_EQ(cuEventRecord(event, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuEventSynchronize(event), CUDA_ERROR_CAPTURED_EVENT);
  EXPECT_EQ(cuEventDestroy(event), CUDA_SUCCESS);
  EXPECT_EQ(end(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED), nullptr);
}

TEST_F(GraphCallsTest, ModesOfCaptures) {
  CUdeviceptr other = 0;
  CUcontext context = nullptr;
  ASSERT_EQ(cuCtxGetCurrent(&context), CUDA_SUCCESS);
  auto elsewhere = [&](auto work) {
    std::thread([&] {
      cuCtxSetCurrent(context);
      work();
    }).join();
  };
  begin(CU_STREAM_CAPTURE_MODE_RELAXED);
  EXPECT_EQ(cuMemAlloc(&other, 8), CUDA_SUCCESS);
  EXPECT_EQ(cuMemFree(other), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphDestroy(end()), CUDA_SUCCESS);

  begin(CU_STREAM_CAPTURE_MODE_THREAD_LOCAL);
  elsewhere([&] {
    CUgraph graph = nullptr;
    EXPECT_EQ(cuMemAlloc(&other, 8), CUDA_SUCCESS);
    EXPECT_EQ(cuMemFree(other), CUDA_SUCCESS);
    EXPECT_EQ(cuStreamEndCapture(stream, &graph),
              CUDA_ERROR_STREAM_CAPTURE_WRONG_THREAD);
  });
  EXPECT_EQ(status(), CU_STREAM_CAPTURE_STATUS_ACTIVE);
  EXPECT_EQ(cuMemAlloc(&other, 8), CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED);
  end(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED);

  begin();
  elsewhere([&] {
    EXPECT_EQ(cuMemAlloc(&other, 8), CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED);
  });
  end(CUDA_ERROR_STREAM_CAPTURE_INVALIDATED);
}

TEST_F(GraphCallsTest, TheLegacyStreamWaitsForOthersThatBlock) {
  CUstream blocking = nullptr;
  CUgraph graph = nullptr;
  EXPECT_EQ(cuStreamBeginCapture(nullptr, CU_STREAM_CAPTURE_MODE_GLOBAL),
            CUDA_ERROR_STREAM_CAPTURE_UNSUPPORTED);
  EXPECT_EQ(cuStreamEndCapture(stream, &graph), CUDA_ERROR_ILLEGAL_STATE);
  begin();
  EXPECT_EQ(cuStreamBeginCapture(stream, CU_STREAM_CAPTURE_MODE_GLOBAL),
            CUDA_ERROR_ILLEGAL_STATE);
  EXPECT_EQ(cuMemsetD8Async(memory, 1, 1, nullptr), CUDA_SUCCESS);
  EXPECT_EQ(number(0), 1u);
  EXPECT_EQ(cuGraphDestroy(end()), CUDA_SUCCESS);

  ASSERT_EQ(cuStreamCreate(&blocking, 0), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamBeginCapture(blocking, CU_STREAM_CAPTURE_MODE_GLOBAL),
            CUDA_SUCCESS);
  EXPECT_EQ(cuMemsetD8Async(memory, 1, 1, nullptr),
            CUDA_ERROR_STREAM_CAPTURE_IMPLICIT);
  EXPECT_EQ(cuStreamEndCapture(blocking, &graph),
            CUDA_ERROR_STREAM_CAPTURE_INVALIDATED);
  EXPECT_EQ(cuStreamDestroy(blocking), CUDA_SUCCESS);
}

TEST_F(GraphCallsTest, MemoryThatIsGoneAtALaunch) {
  expectsLeaks = true;
  CUdeviceptr other = 0;
  ASSERT_EQ(cuMemAlloc(&other, 8), CUDA_SUCCESS);
  begin();
  EXPECT_EQ(cuMemsetD8Async(other, 0, 9, stream), CUDA_ERROR_INVALID_VALUE);
  EXPECT_EQ(cuMemsetD8Async(other, 0, 8, stream), CUDA_SUCCESS);
  CUgraphExec executable = instantiate(end());
  EXPECT_EQ(cuMemFree(other), CUDA_SUCCESS);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_ERROR_ILLEGAL_ADDRESS);
  renewContext();
  lost = true;
}

TEST_F(GraphCallsTest, FailuresCountsAndLeaks) {
  expectsLeaks = true;
  CUgraphExec executable = nullptr;
  EXPECT_EQ(add(once, 0, 1), CUDA_SUCCESS);
  EXPECT_EQ(cuMemcpyAsync(at(0), at(1), 8, stream), CUDA_SUCCESS);
  begin();
  EXPECT_EQ(add(once, 0, 1), CUDA_SUCCESS);
  EXPECT_EQ(add(once, 0, 8), CUDA_SUCCESS); // in another sector
  EXPECT_EQ(cuMemsetD8Async(at(0), 0, 8, stream), CUDA_SUCCESS);
  CUgraph graph = end();
  pikoTestDriverFail("cuGraphInstantiateWithFlags", 1,
                     CUDA_ERROR_OUT_OF_MEMORY);
  EXPECT_EQ(cuGraphInstantiateWithFlags(&executable, graph, 0),
            CUDA_ERROR_OUT_OF_MEMORY);
  executable = instantiate(graph);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
  pikoTestDriverFail("cuGraphLaunch", 1, CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_ERROR_UNKNOWN);
  EXPECT_EQ(cuGraphLaunch(executable, stream), CUDA_SUCCESS);
  EXPECT_EQ(cuStreamSynchronize(stream), CUDA_SUCCESS);
  EXPECT_EQ(cuCtxSynchronize(), CUDA_SUCCESS);
  PikoTestDriverHostCounts counts{};
  pikoTestDriverHostCounts(&counts);
  EXPECT_EQ(counts.launches, 1u);
  EXPECT_EQ(counts.copies, 1u);
  EXPECT_EQ(counts.fills, 0u);
  EXPECT_EQ(counts.graphLaunches, 2u);
  EXPECT_EQ(counts.graphKernels, 4u);
  EXPECT_EQ(counts.graphSectors, 2u * 2);
  EXPECT_EQ(counts.waits, 2u);
  renewContext();
  lost = true;
  EXPECT_STREQ(pikoTestDriverLeaks(),
               "4096 bytes of managed memory\nmodule k twice\n1 streams\n"
               "1 graphs\n1 executable graphs\n");
}

} // namespace
