//===- particle.h - What pipeline, application and CUDA kernels share -----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PARTICLES_PARTICLE_H
#define PARTICLES_PARTICLE_H

namespace particles {

#ifdef __CUDA__
#define PARTICLES_DEVICE __host__ __device__
#else
#define PARTICLES_DEVICE
#endif

struct Particle {
  float x, y;   ///< In pixels.
  float vx, vy; ///< Pixels a frame.
  float heat;   ///< From 0 to 1.
};

/// A frame later, in a box that it bounces off.
PARTICLES_DEVICE inline Particle move(Particle p, float width, float height) {
  p.x += p.vx;
  p.y += p.vy;
  p.vy += 0.05f;
  if (p.x < 0 || p.x > width) {
    p.vx = -p.vx;
    p.x = p.x < 0 ? -p.x : 2 * width - p.x;
  }
  if (p.y > height) {
    p.vy = -0.9f * p.vy;
    p.y = 2 * height - p.y;
  }
  return p;
}

/// A sum of light as a byte of a picture.
PARTICLES_DEVICE inline unsigned char toByte(float light) {
  return static_cast<unsigned char>(light < 1 ? light * 255 : 255.0f);
}

} // namespace particles

#endif // PARTICLES_PARTICLE_H
