//===- kernels.cu - What the application itself does on the GPU -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "particle.h"

using namespace particles;

extern "C" __global__ void moveAll(const Particle *from, Particle *to,
                                   int count, float width, float height) {
  int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count)
    to[i] = move(from[i], width, height);
}

/// RGB of the picture, which has four floats a pixel, as a display wants it.
extern "C" __global__ void show(const float *picture, long long pitch,
                                unsigned char *display, int width, int height) {
  int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  int y = static_cast<int>(blockIdx.y);
  if (x >= width || y >= height)
    return;
  const float *pixel = picture + y * (pitch / 4) + 4 * x;
  for (int c = 0; c < 3; ++c)
    display[3 * (y * width + x) + c] = toByte(pixel[c]);
}
