// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Dots that are plotted, and a stage that keeps a kernel after kernel busy:
// what the tests of the Python module run.
#include <piko.h>

#include <array>

struct Dot {
  glm::vec2 position;
  glm::vec3 color;
  int32_t id;
};
struct Pixel {
  glm::vec3 color{0};
  int32_t count = 0;
};
struct Knot {
  glm::vec3 at;
  float weight;
};
struct Style {
  float gain = 1;
  bool isDark = false;
  std::array<Knot, 2> knots{};
  glm::mat3 turn{1};
  double scale = 1;
};
struct Canvas {
  piko::Image<Pixel> image;
  piko::Buffer<float> weights;
  piko::Buffer<glm::vec3> tints;
  piko::Buffer<int32_t> order; // as long as there are dots
  glm::vec3 light;
  int32_t offset = 5;
  Style style;
};

constexpr int tile = piko::tunable("tile", 8, 16, 32);

struct Plot : piko::Stage<tile, tile, 64, Dot>, piko::Uses<Canvas> {
  void assignBin(const Dot &d) { assignToBin(d, binFromPosition(d.position)); }
  void schedule(piko::BinId) { specifySchedule(piko::LoadBalance); }
  void process(const Dot &d) {
    state().order[d.id] = d.id + state().offset;
    float weight = state().weights[d.id] * state().style.gain;
    glm::vec3 tint = state().tints[d.id] * state().light;
    update(state().image, glm::ivec2(d.position), [&](Pixel &p) {
      p.color += weight * d.color + tint + state().style.knots[1].at;
      ++p.count;
    });
  }
};

struct Dots : piko::Pipe<Canvas> {
  Plot plot;
  Dots() {
    source(plot);
    allocateForSource(state().order, 0);
  }
};

struct Sums {
  piko::Buffer<int32_t> values;
};

/// A hop for each number down to 0.
struct Count : piko::Stage<0, 0, 64, int32_t, int32_t>, piko::Uses<Sums> {
  void process(const int32_t &i) {
    if (i > 0)
      emit(i - 1);
    else
      state().values[0] = 7;
  }
};

struct Countdown : piko::Pipe<Sums> {
  Count count;
  Countdown() {
    source(count);
    connect(count, 0, count);
  }
};

/// An index outside of its buffer, for i > 1.
struct Store : piko::Stage<0, 0, 64, int32_t>, piko::Uses<Sums> {
  void process(const int32_t &i) { state().values[i] = i; }
};

struct Outside : piko::Pipe<Sums> {
  Store store;
  Outside() { source(store); }
};
