// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include <piko.h>
#include <piko/scene.h>

struct Comet {
  glm::vec2 head, tail;
  glm::vec3 color;
};
struct Spark {
  glm::vec2 at;
  float radius;
  glm::vec3 color;
};
struct Glow {
  glm::ivec2 pixel;
  glm::vec3 light;
};

struct Sky {
  piko::Image<piko::scene::Color> image;
};

struct Fly : piko::Stage<0, 0, 64, Comet, Spark> {
  void process(const Comet &comet) {
    parallelFor(48, [&](int i) {
      float back = float(i) / 47;
      glm::vec2 path = comet.tail - comet.head;
      glm::vec2 aside = glm::vec2(-path.y, path.x) * 0.25f * back * back;
      emit({comet.head + back * path + aside, 7 * (1 - back) + 1,
            comet.color * (1 - back) * 0.4f});
    });
  }
};

struct Burn : piko::Stage<16, 16, 64, Spark, Glow> {
  void assignBin(const Spark &spark) {
    assignToBoundingBox(spark, spark.at - spark.radius,
                        spark.at + spark.radius);
  }

  void process(const Spark &spark) {
    parallelForPixels([&](glm::ivec2 p) {
      float far = glm::distance(glm::vec2(p) + 0.5f, spark.at) / spark.radius;
      if (far < 1)
        emit({p, spark.color * (1 - far * far)});
    });
  }
};

struct Shine : piko::Stage<16, 16, 64, Glow>, piko::Uses<Sky> {
  void assignBin(const Glow &glow) { assignToPreviousBins(glow); }

  void process(const Glow &glow) {
    update(state().image, glow.pixel, [&](piko::scene::Color &pixel) {
      pixel.rgba += glm::vec4(glow.light, 1);
    });
  }
};

struct Comets : piko::Pipe<Sky> {
  Fly fly;
  Burn burn;
  Shine shine;
  Comets() {
    source(fly);
    connect(fly, 0, burn);
    connect(burn, 0, shine);
  }
};
