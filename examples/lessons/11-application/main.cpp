// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "sunflower.h" // made by pikoc

#include <algorithm>
#include <cmath>
#include <fstream>
#include <vector>

using pipelines::Sunflower;

// Each seed is turned by the golden angle against the one before it.
static std::vector<Sunflower::Disc> grow(int count) {
  std::vector<Sunflower::Disc> seeds;
  for (int i = 0; i < count; ++i) {
    float part = float(i) / float(count), angle = 2.399963f * float(i);
    float away = 88 * std::sqrt(part);
    seeds.push_back(
        {.center = {128 + away * std::cos(angle), 96 + away * std::sin(angle)},
         .radius = 2 + 4 * part,
         .color = {0.45f + 0.55f * part, 0.25f + 0.5f * part, 0.1f}});
  }
  return seeds;
}

int main() {
  std::vector<Sunflower::Disc> seeds = grow(420);
  Sunflower pipe;
  pipe.setDomain({256, 192});
  pipe.state().light = {-0.5f, -0.5f, 0.7f};
  pipe.feed(pipe.draw, seeds);
  pipe.run();

  std::ofstream file("sunflower.ppm", std::ios::binary);
  file << "P6\n256 192\n255\n";
  for (const Sunflower::Color &pixel : pipe.state().image.view().elements)
    for (int channel = 0; channel < 3; ++channel)
      file.put(char(std::clamp(pixel.rgba[channel], 0.0f, 1.0f) * 255 + 0.5f));
  return file.flush() ? 0 : 1;
}
