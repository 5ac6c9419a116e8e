//===- main.cpp - Particles in a GPU's memory -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The particles are in memory of the GPU, moved by a kernel of the
// application's own; a pipeline draws them from there, and another kernel shows
// the picture where the pipeline has left it. All of it is in the order of one
// stream, and nothing is copied. Without a GPU the same object draws on the
// processor.
//
//   pikoc particles.piko.cpp --target=auto -o particles.o --header particles.h
//   nvcc -ptx -fmad=false -arch=sm_70 kernels.cu
//   c++ -std=c++20 main.cpp particles.o -lpikort -lomp -lcuda
//   ./a.out particles.ppm 100
//
//===----------------------------------------------------------------------===//
#include "particle.h"
#include "particles.h" // made by pikoc

#include <cuda.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

using particles::Particle;
using pipelines::Particles;
namespace rt = piko::rt;

constexpr int width = 320, height = 200, count = 2000;

static std::vector<Particle> makeParticles() {
  std::vector<Particle> made;
  for (int i = 0; i < count; ++i) {
    float share = float(i) / count;
    made.push_back({float(i * 37 % width), float(i * 53 % height),
                    float(i % 7) - 3, float(i % 5) - 2, share});
  }
  return made;
}

static void prepare(Particles &pipe) {
  pipe.setDomain({width, height});
  pipe.state().cold = glm::vec3(0.1f, 0.2f, 0.6f);
  pipe.state().hot = glm::vec3(1.0f, 0.5f, 0.1f);
}

static void check(CUresult result, const char *doing) {
  const char *name = nullptr;
  if (result == CUDA_SUCCESS)
    return;
  cuGetErrorName(result, &name);
  std::fprintf(stderr, "%s: %s\n", doing, name ? name : "unknown error");
  std::exit(1);
}

//===----------------------------------------------------------------------===//
// On a GPU
//===----------------------------------------------------------------------===//

/// What the application has there: in the primary context, as pipelines have.
class Gpu {
public:
  explicit Gpu(int number) : number(number) {
    check(cuInit(0), "cuInit");
    check(cuDeviceGet(&device, number), "cuDeviceGet");
    check(cuDevicePrimaryCtxRetain(&context, device), "the primary context");
    check(cuCtxSetCurrent(context), "cuCtxSetCurrent");
    std::ifstream file("kernels.ptx");
    std::string ptx{std::istreambuf_iterator<char>(file), {}};
    check(cuModuleLoadDataEx(&module, ptx.c_str(), 0, nullptr, nullptr),
          "kernels.ptx");
    check(cuModuleGetFunction(&moveAll, module, "moveAll"), "moveAll");
    check(cuModuleGetFunction(&show, module, "show"), "show");
    check(cuStreamCreate(&stream, CU_STREAM_NON_BLOCKING), "a stream");
    for (CUdeviceptr *memory : {&now, &next})
      check(cuMemAlloc(memory, count * sizeof(Particle)), "cuMemAlloc");
    check(cuMemAlloc(&display, width * height * 3), "cuMemAlloc");
  }
  Gpu(const Gpu &) = delete;
  Gpu &operator=(const Gpu &) = delete;
  ~Gpu() {
    for (CUdeviceptr memory : {now, next, display})
      cuMemFree(memory);
    cuStreamDestroy(stream);
    cuModuleUnload(module);
    cuCtxSetCurrent(nullptr);
    cuDevicePrimaryCtxRelease(device);
  }

  template <class... Arguments>
  void launch(CUfunction kernel, int blocksX, int blocksY,
              Arguments... arguments) {
    void *places[] = {&arguments...};
    check(cuLaunchKernel(kernel, unsigned(blocksX), unsigned(blocksY), 1, 128,
                         1, 1, 0, stream, places, nullptr),
          "a launch");
  }

  const int number;
  CUdevice device = 0;
  CUcontext context = nullptr;
  CUmodule module = nullptr;
  CUfunction moveAll = nullptr, show = nullptr;
  CUstream stream = nullptr;
  CUdeviceptr now = 0, next = 0; ///< Particles: as they are drawn, and later.
  CUdeviceptr display = 0;       ///< Or a mapped buffer of OpenGL or Vulkan.
};

static std::vector<unsigned char> drawOnGpu(Particles &pipe, int frames) {
  Gpu gpu(pipe.device().number);
  std::vector<Particle> start = makeParticles();
  check(cuMemcpyHtoDAsync(gpu.now, start.data(), count * sizeof(Particle),
                          gpu.stream),
        "the upload");
  for (int frame = 0; frame < frames; ++frame) {
    // The frame before may still be drawn from `now`.
    gpu.launch(gpu.moveAll, (count + 127) / 128, 1, gpu.now, gpu.next, count,
               float(width), float(height));
    std::swap(gpu.now, gpu.next);
    pipe.feed(pipe.glow, rt::DeviceSpan<Particle>(gpu.now, count));
    pipe.runAsync(rt::Stream(gpu.stream));
    auto picture = pipe.state().picture.deviceView();
    gpu.launch(gpu.show, (width + 127) / 128, height, picture.address(),
               (long long)(picture.pitch()), gpu.display, width, height);
  }
  pipe.wait(); // how the last frame went; runAsync said it of the others
  std::vector<unsigned char> shown(width * height * 3);
  check(cuMemcpyDtoHAsync(shown.data(), gpu.display, shown.size(), gpu.stream),
        "the download");
  check(cuStreamSynchronize(gpu.stream), "the last frame");
  return shown;
}

//===----------------------------------------------------------------------===//
// On the processor
//===----------------------------------------------------------------------===//

static std::vector<unsigned char> drawOnProcessor(Particles &pipe, int frames) {
  std::vector<Particle> all = makeParticles();
  std::vector<unsigned char> shown;
  pipe.feed(pipe.glow, all);
  for (int frame = 0; frame < frames; ++frame) {
    for (Particle &particle : all)
      particle = particles::move(particle, width, height);
    pipe.run();
    shown.clear();
    for (const glm::vec4 &sum : pipe.state().picture.view().elements)
      for (int c = 0; c < 3; ++c)
        shown.push_back(particles::toByte(sum[c]));
  }
  return shown;
}

int main(int argc, char **argv) {
  const char *name = argc > 1 ? argv[1] : "particles.ppm";
  int frames = argc > 2 ? std::atoi(argv[2]) : 100;
  try {
    Particles pipe;
    pipe.created().orThrow();
    prepare(pipe);
    bool isOnGpu = pipe.device().number != PIKORT_PROCESSOR;
    std::vector<unsigned char> shown =
        isOnGpu ? drawOnGpu(pipe, frames) : drawOnProcessor(pipe, frames);
    std::ofstream file(name, std::ios::binary);
    file << "P6\n" << width << " " << height << "\n255\n";
    file.write(reinterpret_cast<const char *>(shown.data()),
               static_cast<std::streamsize>(shown.size()));
    std::printf("%d frames on %s\n", frames,
                isOnGpu ? "a GPU" : "the processor");
    return file.flush() ? 0 : 1;
  } catch (const piko::Error &error) {
    std::fprintf(stderr, "particles: %s\n", error.what());
    return 1;
  }
}
