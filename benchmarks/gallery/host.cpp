//===- host.cpp - Hosts of examples that piko-render cannot feed ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// host EXAMPLE INPUT OUTPUT.ppm FRAMES: runs an example on what INPUT holds, a
// picture (.ppm) or a mesh (.obj), writes a picture, and prints the median of
// the milliseconds of its frames. benchmarks/gallery.py builds and runs it.
//
//===----------------------------------------------------------------------===//
#include "bilateral.h"
#include "histogram.h"
#include "particles.h"
#include "voxelize.h"

#include "../../examples/particles/particle.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace {

/// A picture of colours from 0 to 1.
struct Picture {
  int width = 256, height = 192;
  std::vector<glm::vec3> pixels = std::vector<glm::vec3>(256 * 192);
  glm::vec3 &at(int x, int y) { return pixels[size_t(y) * width + x]; }
};

[[noreturn]] void fail(const std::string &message) {
  std::fprintf(stderr, "host: error: %s\n", message.c_str());
  std::exit(1);
}

Picture readPicture(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  std::string magic;
  int most = 0;
  Picture picture;
  file >> magic >> picture.width >> picture.height >> most;
  if (!file || magic != "P6" || most != 255 || picture.width != 256 ||
      picture.height != 192)
    fail("expected a PPM picture of 256 x 192 pixels, but got '" + path + "'");
  file.get();
  for (glm::vec3 &pixel : picture.pixels)
    for (int channel = 0; channel < 3; ++channel)
      pixel[channel] = float(file.get()) / 255;
  if (!file)
    fail("'" + path + "' is cut off");
  return picture;
}

void writePicture(const std::string &path, const Picture &picture) {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << picture.width << " " << picture.height << "\n255\n";
  for (const glm::vec3 &pixel : picture.pixels)
    for (int channel = 0; channel < 3; ++channel)
      file.put(char(std::clamp(pixel[channel], 0.0f, 1.0f) * 255 + 0.5f));
  if (!file.flush())
    fail("cannot write '" + path + "'");
}

/// Milliseconds of the median frame.
double timeFrames(int frames, const std::function<void()> &run) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> times;
  for (int i = -3; i < frames; ++i) {
    auto start = Clock::now();
    run();
    std::chrono::duration<double, std::milli> taken = Clock::now() - start;
    if (i >= 0)
      times.push_back(taken.count());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

/// On the left as it came in, with noise; on the right filtered.
double filter(Picture &picture, int frames) {
  using Pipe = pipelines::Bilateral;
  std::mt19937 draw(1);
  std::vector<Pipe::Pixel> pixels;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      picture.at(x, y) += glm::vec3(float(draw() % 4) * 0.04f - 0.06f);
      pixels.push_back({.at = {x, y}, .color = picture.at(x, y)});
    }
  Pipe pipe;
  pipe.setDomain({picture.width, picture.height});
  pipe.state().sigmaColor = 0.25f;
  pipe.feed(pipe.load, pixels);
  double time = timeFrames(frames, [&] { pipe.run(); });
  auto output = pipe.state().output.view();
  for (int y = 0; y < picture.height; ++y)
    for (int x = picture.width / 2; x < picture.width; ++x)
      picture.at(x, y) = output(x, y);
  return time;
}

/// On the left as dark as it came in, on the right equalized.
double equalize(Picture &picture, int frames) {
  using Pipe = pipelines::Equalize;
  std::vector<Pipe::Pixel> pixels;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      glm::vec3 color = picture.at(x, y);
      float gray = 0.35f * (0.3f * color.r + 0.6f * color.g + 0.1f * color.b);
      picture.at(x, y) = glm::vec3(gray);
      pixels.push_back({.at = {x, y}, .gray = gray});
    }
  Pipe pipe;
  pipe.setDomain({picture.width, picture.height});
  std::vector<uint32_t> histogram(256), below(256);
  pipe.state().histogram.bind(histogram);
  pipe.state().below.bind(below);
  pipe.feed(pipe.count, pixels);
  double time = timeFrames(frames, [&] {
    std::fill(histogram.begin(), histogram.end(), 0);
    pipe.run();
  });
  auto output = pipe.state().output.view();
  for (int y = 0; y < picture.height; ++y)
    for (int x = picture.width / 2; x < picture.width; ++x)
      picture.at(x, y) = glm::vec3(output(x, y));
  return time;
}

std::vector<pipelines::Voxelizer::Triangle> readMesh(const std::string &path) {
  std::ifstream file(path);
  std::vector<glm::vec3> points;
  std::vector<pipelines::Voxelizer::Triangle> triangles;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      glm::vec3 p;
      words >> p.x >> p.y >> p.z;
      points.push_back(glm::vec3(64, 48, 32) + glm::vec3(44, -44, -36) * p);
    } else if (kind == "f") {
      pipelines::Voxelizer::Triangle triangle{};
      std::string corner;
      for (int i = 0; i < 3 && words >> corner; ++i)
        triangle.corner[i] = points.at(std::stoul(corner) - 1);
      triangle.material = int(triangles.size());
      triangles.push_back(triangle);
    }
  }
  if (triangles.empty())
    fail("expected triangles in '" + path + "'");
  return triangles;
}

/// Voxels as cubes of two pixels, seen from the front.
double voxelize(const std::string &mesh, Picture &picture, int frames) {
  auto triangles = readMesh(mesh);
  pipelines::Voxelizer pipe;
  pipe.setDomain({128, 96, 64});
  pipe.feed(pipe.voxelize, triangles);
  double time = timeFrames(frames, [&] { pipe.run(); });
  auto voxels = pipe.state().voxels.view();
  auto depth = [&](int x, int y) {
    int z = 0;
    while (z < 64 && !voxels(x, y, z).triangles)
      ++z;
    return z;
  };
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      int z = depth(x / 2, y / 2), left = depth(std::max(x / 2 - 1, 0), y / 2),
          up = depth(x / 2, std::max(y / 2 - 1, 0));
      float light = 0.75f - 0.012f * float(z) + (left > z ? 0.12f : 0) +
                    (up > z ? 0.2f : 0);
      picture.at(x, y) =
          z < 64 ? light * glm::vec3(1, 0.85f, 0.6f) : glm::vec3(0.1f);
    }
  return time;
}

double glow(Picture &picture, int frames) {
  // A fountain, each of whose drops is on its way for another time.
  std::mt19937 draw(1);
  auto share = [&] { return float(draw() >> 8) * 0x1p-24f; };
  std::vector<particles::Particle> all;
  for (int i = 0; i < 3000; ++i) {
    float aside = share() + share() + share() - 1.5f,
          up = 3.2f + 0.5f * share();
    particles::Particle drop{128, 180, 0.9f * aside, -up, 0};
    int age = int(i % 150);
    for (int step = 0; step < age; ++step)
      drop = move(drop, 256, 192);
    drop.heat = 1 - float(age) / 150;
    all.push_back(drop);
  }
  pipelines::Particles pipe;
  pipe.setDomain({picture.width, picture.height});
  pipe.state().cold = glm::vec3(0.1f, 0.2f, 0.6f) * 0.5f;
  pipe.state().hot = glm::vec3(1.0f, 0.5f, 0.1f) * 0.5f;
  pipe.feed(pipe.glow, all);
  double time = timeFrames(frames, [&] { pipe.run(); });
  auto light = pipe.state().picture.view();
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      picture.at(x, y) = glm::vec3(0.1f) + glm::vec3(light(x, y));
  return time;
}

} // namespace

int main(int argc, char **argv) {
  if (argc != 5)
    fail("expected EXAMPLE INPUT OUTPUT.ppm FRAMES");
  std::string example = argv[1], input = argv[2];
  int frames = std::max(std::atoi(argv[4]), 1);
  bool takesPicture = example == "bilateral" || example == "histogram";
  Picture picture = takesPicture ? readPicture(input) : Picture();
  double time = 0;
  if (example == "bilateral")
    time = filter(picture, frames);
  else if (example == "histogram")
    time = equalize(picture, frames);
  else if (example == "voxelize")
    time = voxelize(input, picture, frames);
  else if (example == "particles")
    time = glow(picture, frames);
  else
    fail("expected bilateral, histogram, voxelize or particles, but got '" +
         example + "'");
  writePicture(argv[3], picture);
  std::printf("%.4f\n", time);
}
