// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Site {
  glm::vec2 position;
  glm::vec3 color;
};

struct Window {
  float reach = 40; // pixels
  piko::Image<piko::scene::Color> image;
};

struct Glaze : piko::Stage<16, 16, 64, Site>, piko::Uses<Window> {
  void assignBin(const Site &site) {
    assignToBoundingBox(site, site.position - state().reach,
                        site.position + state().reach);
  }

  void process(const piko::List<Site> &sites) {
    parallelForPixels([&](glm::ivec2 p) {
      float first = 1e9f, second = 1e9f;
      int nearest = 0;
      for (int i = 0; i < int(sites.size()); ++i) {
        float far = glm::distance(glm::vec2(p) + 0.5f, sites[i].position);
        if (far < first) {
          second = first;
          first = far;
          nearest = i;
        } else if (far < second) {
          second = far;
        }
      }
      float lead = glm::clamp(second - first - 1, 0.0f, 1.0f);
      float glow = 1 - glm::floor(first / 4) / 9;
      state().image.store(p,
                          {glm::vec4(lead * glow * sites[nearest].color, 1)});
    });
  }
};

struct Glass : piko::Pipe<Window> {
  Glaze glaze;
  Glass() { source(glaze); }
};
