// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Hill {
  glm::vec2 center;
  float radius, height;
};

struct Land {
  piko::Image<float> ground;
  piko::Image<piko::scene::Color> image;
};

struct Raise : piko::Stage<16, 16, 64, Hill>, piko::Uses<Land> {
  void assignBin(const Hill &hill) {
    assignToBoundingBox(hill, hill.center - hill.radius,
                        hill.center + hill.radius);
  }

  void process(const Hill &hill) {
    parallelForPixels([&](glm::ivec2 p) {
      glm::vec2 away = (glm::vec2(p) - hill.center) / hill.radius;
      float slope = glm::max(1 - glm::dot(away, away), 0.0f);
      update(state().ground, p,
             [&](float &ground) { ground += hill.height * slope * slope; });
    });
  }
};

struct Light : piko::Stage<16, 16, 64, piko::scene::Nothing>, piko::Uses<Land> {
  void assignBin(const piko::scene::Nothing &nothing) { assignToAll(nothing); }

  void schedule(piko::BinId) {
    everyBin();
    endStage<Raise>();
  }

  float ground(glm::ivec2 p) {
    return state().ground(glm::clamp(p, glm::ivec2(0), domain() - 1));
  }

  void process(const piko::List<piko::scene::Nothing> &) {
    parallelForPixels([&](glm::ivec2 p) {
      float height = ground(p);
      glm::vec2 rise{
          ground(p + glm::ivec2(1, 0)) - ground(p - glm::ivec2(1, 0)),
          ground(p + glm::ivec2(0, 1)) - ground(p - glm::ivec2(0, 1))};
      glm::vec3 normal = glm::normalize(glm::vec3(-14.0f * rise, 1));
      float light = glm::max(glm::dot(normal, {-0.6f, -0.6f, 0.55f}), 0.3f);
      float step = glm::floor(10 * height) / 10;
      glm::vec3 low(0.3, 0.55, 0.25), high(1, 0.95, 0.85), sea(0.15, 0.35, 0.6);
      glm::vec3 color =
          step < 0.1f
              ? sea * (1 + height)
              : glm::mix(low, high, glm::min(step, 1.0f)) * 1.3f * light;
      state().image.store(p, {glm::vec4(color, 1)});
    });
  }
};

struct Relief : piko::Pipe<Land> {
  Raise raise;
  Light light;
  Relief() {
    source(raise);
    source(light);
  }
};
