// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- CudaFixture.cpp - A program for the driver for tests ---------------===//

#include "cuda/CudaFixture.h"
#include "Symbols.h"

#include <cstdlib>
#include <cstring>
#include <elf.h>
#include <numeric>

using namespace piko::cuda;

// out[i] = items[i] * factor, for the positions of a block's units.
const char *const ScaleProgram::goodPTX = R"(
.version 6.0
.target sm_70
.address_size 64

.visible .entry scale(
  .param .u64 input,
  .param .u64 out,
  .param .u64 factor,
  .param .u64 log
)
.maxntid 32, 1, 1
{
  .reg .pred %p<3>;
  .reg .b32 %r<7>;
  .reg .b64 %rd<18>;

  ld.param.u64 %rd14, [input];
  ld.param.u64 %rd3, [out];
  ld.param.u64 %rd4, [factor];
  ld.global.u64 %rd2, [%rd14];
  ld.global.u64 %rd1, [%rd14+32];
  ld.global.u64 %rd15, [%rd14+40];
  mov.u32 %r1, %ctaid.x;
  cvt.u64.u32 %rd16, %r1;
  mov.u32 %r6, %nctaid.x;
  cvt.u64.u32 %rd17, %r6;
  // log
unit:
  setp.ge.s64 %p2, %rd16, %rd15;
  @%p2 bra done;
  mul.lo.s64 %rd5, %rd16, 40;
  add.s64 %rd16, %rd16, %rd17;
  add.s64 %rd6, %rd1, %rd5;
  ld.global.u64 %rd7, [%rd6+16];
  ld.global.u64 %rd8, [%rd6+24];
  ld.global.u32 %r2, [%rd4];
  mov.u32 %r3, %tid.x;
  cvt.u64.u32 %rd9, %r3;
  add.s64 %rd10, %rd7, %rd9;
next:
  setp.ge.s64 %p1, %rd10, %rd8;
  @%p1 bra unit;
  shl.b64 %rd11, %rd10, 2;
  add.s64 %rd12, %rd2, %rd11;
  ld.global.u32 %r4, [%rd12];
  mul.lo.s32 %r5, %r4, %r2;
  add.s64 %rd13, %rd3, %rd11;
  st.global.u32 [%rd13], %r5;
  add.s64 %rd10, %rd10, 32;
  bra next;
done:
  ret;
}
)";
const char *const ScaleProgram::wrongPTX =
    ".version 6.0\n.target sm_70\n"
    ".address_size 64\nmultiply everything;\n";

std::string ScaleProgram::failingPTX() {
  std::string ptx = goodPTX;
  return ptx.replace(ptx.find("  // log"), 8,
                     "  ld.param.u64 %rd13, [log];\n"
                     "  mov.u64 %rd12, 1;\n"
                     "  st.global.u64 [%rd13+32], %rd12;");
}

std::vector<pikoir_cuda_image> ScaleProgram::images;
const char *ScaleProgram::kernel = "scale";
bool ScaleProgram::strayPointer = false;

void ScaleProgram::bring(const char *ptx,
                         std::vector<pikoir_cuda_image> cubins) {
  static const Elf64_Ehdr cubin = [] {
    Elf64_Ehdr header{};
    std::memcpy(header.e_ident, ELFMAG, SELFMAG);
    header.e_ident[EI_CLASS] = ELFCLASS64;
    header.e_machine = 190;
    return header;
  }();
  images = std::move(cubins);
  for (pikoir_cuda_image &image : images)
    image.data = &cubin;
  images.push_back({0, 0, ptx});
  images.push_back({0, 0, nullptr});
}

void ScaleProgram::writeArguments(pikort_pipeline *p, const pikoir_input *input,
                                  pikoir_log *log, int64_t *words) {
  static int32_t local[64];
  const void *arguments[] = {input,
                             strayPointer ? reinterpret_cast<uint8_t *>(local)
                                          : pikoir_get_state(p, 1)->data,
                             pikoir_get_state(p, 0)->data, log};
  std::memcpy(words, arguments, sizeof(arguments));
}

void ScaleProgram::declareSteps(pikort_pipeline *p) {
  static pikoir_cuda_grid grids[2];
  grids[0] = {kernel, 32, 4, writeArguments};
  static const pikoir_cuda_step steps[] = {
      {PIKOIR_STEP_STAGE, 0, -1, -1, grids, nullptr}};
  pikoir_cuda_program(p, steps, 1);
}

static void setup(pikort_pipeline *p) {
  pikoir_cuda_module(p, ScaleProgram::images.data());
  ScaleProgram::declareSteps(p);
  pikoir_cuda_kernel(p, "scale", "scaler", "scale.cpp:7");
  pikoir_declare_pipeline(p, "Scale", 1);
  pikoir_declare_record(p, 0, "int", 4, 4);
  pikoir_declare_field(p, 0, "value", PIKORT_I32, 0, 1, 0);
  pikoir_declare_state(p, 0, "factor", PIKORT_CONSTANT, 0, 0, -1, nullptr);
  pikoir_declare_state(p, 1, "out", PIKORT_BUFFER, 0, 1, -1, nullptr);
  pikoir_declare_written(p, 1);
  int64_t bins[] = {0};
  pikoir_declare_stage(p, 0, "scaler", 0, bins, PIKOIR_LOAD_BALANCE, 0,
                       PIKOIR_SPLIT, 1);
  pikoir_declare_source(p, 0, 0);
}

static int32_t run(pikort_pipeline *p) {
  const pikoir_input *in = pikoir_begin(p, 0);
  if (!in)
    return pikoir_status(p);
  int64_t blocks = pikoir_blocks(p, 0, 0, 32);
  pikoir_log *log = pikoir_log_open(p, 0, 0);
  int64_t arguments[4];
  ScaleProgram::writeArguments(p, in, log, arguments);
  pikoir_cuda_launch(p, ScaleProgram::kernel, blocks, 32, arguments, 4);
  pikoir_log_close(p, log);
  return pikoir_end(p, 0);
}

const pikort_program ScaleProgram::program{PIKORT_ABI_VERSION, "Scale", setup,
                                           run};

// --- The host ----------------------------------------------------------------

static void succeed(CUresult result) { EXPECT_EQ(result, CUDA_SUCCESS); }

HostContext::HostContext(int32_t device) : device(device) {
  succeed(cuInit(0));
  succeed(cuDevicePrimaryCtxRetain(&handle, device));
  succeed(cuCtxSetCurrent(handle));
}

HostContext::~HostContext() {
  succeed(cuCtxSetCurrent(nullptr));
  succeed(cuDevicePrimaryCtxRelease(device));
}

DeviceNumbers::DeviceNumbers(const std::vector<int32_t> &values)
    : count(values.size()) {
  succeed(cuMemAlloc(&address, count * sizeof(int32_t)));
  succeed(cuMemcpyHtoDAsync(address, values.data(), count * sizeof(int32_t),
                            nullptr));
  succeed(cuStreamSynchronize(nullptr));
}

DeviceNumbers::~DeviceNumbers() { cuMemFree(address); }

std::vector<int32_t> DeviceNumbers::get() const {
  std::vector<int32_t> values(count);
  succeed(cuMemcpyDtoHAsync(values.data(), address, count * sizeof(int32_t),
                            nullptr));
  return values;
}

// --- The tests ---------------------------------------------------------------

void Cuda::SetUpTestSuite() {
  setenv("PIKO_CUDA_DRIVER", PIKO_TEST_DRIVER, 1);
  setenv("PIKO_TEST_DRIVER_DEVICES", "2", 1);
}

void Cuda::SetUp() {
  bring(goodPTX);
  kernel = "scale";
  strayPointer = false;
  std::iota(numbers.begin(), numbers.end(), 0);
  pikoTestDriverDelay(0);
  pikoTestDriverReset();
}

void Cuda::TearDown() {
  EXPECT_STREQ(pikoTestDriverAlive(), "");
  EXPECT_STREQ(pikoTestDriverLeaks(), "");
  unsetenv("PIKO_CUDA_DEVICE");
}

piko::rt::Status Cuda::bind(piko::rt::Pipeline &pipe) {
  int32_t factor = 3;
  for (const auto &status :
       {pipe.domain({8}), pipe.constant("factor", factor),
        pipe.buffer("out", std::span(out)), pipe.source(0, numbers)})
    if (!status)
      return status;
  return {};
}

piko::rt::Status Cuda::scale(int runs, piko::rt::Device device) {
  piko::rt::Pipeline pipe(program, device);
  if (auto status = pipe.created(); !status)
    return status;
  std::fill(out.begin(), out.end(), -1);
  piko::rt::Status status = bind(pipe);
  for (int i = 0; i < runs && status; ++i)
    status = pipe.run();
  return status;
}

void Cuda::expectScaled(const std::vector<int32_t> &values, int32_t factor) {
  for (size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(values[i], factor * static_cast<int32_t>(i));
}

PikoTestDriverHostCounts Cuda::hostCounts() {
  PikoTestDriverHostCounts counts;
  pikoTestDriverHostCounts(&counts);
  return counts;
}

void Cuda::expectIn(const piko::rt::Status &status,
                    std::initializer_list<const char *> parts) {
  for (const char *part : parts)
    EXPECT_NE(status.message().find(part), std::string::npos)
        << status.message();
}
