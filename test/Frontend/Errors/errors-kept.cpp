// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The pixel of an update is there for the update alone.
// RUN: not pikoc %s -DCASE=1 -o %t 2>&1 | FileCheck %s --check-prefix=POINTER
// RUN: not pikoc %s -DCASE=1 --check -o %t 2>&1 | FileCheck %s --check-prefix=POINTER
// RUN: not pikoc %s -DCASE=2 -o %t 2>&1 | FileCheck %s --check-prefix=GIVEN
// RUN: not pikoc %s -DCASE=3 -o %t 2>&1 | FileCheck %s --check-prefix=READ
// RUN: not pikoc %s -DCASE=4 -o %t 2>&1 | FileCheck %s --check-prefix=STRUCT
// RUN: not pikoc %s -DCASE=5 -o %t 2>&1 | FileCheck %s --check-prefix=CHOSEN
// RUN: not pikoc %s -DCASE=6 -o %t 2>&1 | FileCheck %s --check-prefix=LOOP
// RUN: not pikoc %s -DCASE=7 -o %t 2>&1 | FileCheck %s --check-prefix=ATOMIC
// RUN: not pikoc %s -DCASE=8 -o %t 2>&1 | FileCheck %s --check-prefix=IMAGE
// RUN: not pikoc %s -DCASE=9 -o %t 2>&1 | FileCheck %s --check-prefix=CALLED
// RUN: not pikoc %s -DCASE=10 -o %t 2>&1 | FileCheck %s --check-prefix=ITERATION
// RUN: pikoc %s -DCASE=0 --emit=authored -o - | FileCheck %s --check-prefix=FINE
// RUN: pikoc %s -DCASE=0 --emit=authored --check -o - | FileCheck %s --check-prefix=FINE
// FINE: piko.update
#include <piko.h>

struct Pixel {
  float z = 1;
  int count = 0;
  float samples[3] = {};
};
struct State {
  piko::Image<Pixel> image;
  piko::Buffer<int> out;
};
struct Keeper {
  int n;
  Pixel *pixel;
};
// CALLED: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
inline void add(Pixel &pixel, int n) { pixel.count += n; }

struct Stage : piko::Stage<0, 0, 1, int>, piko::Uses<State> {
  void process(const int &i) {
#if CASE == 1
    Pixel *kept = nullptr;
    // POINTER: errors-kept.cpp:[[#@LINE + 3]]:17: error: expected a pixel to be used inside its update, but this reference to it was kept
    // POINTER: errors-kept.cpp:[[#@LINE + 1]]:5: note: the update is here
    update(state().image, {i, 2}, [&](Pixel &p) { kept = &p; });
    kept->count = 7;
#elif CASE == 2
    // GIVEN: errors-kept.cpp:[[#@LINE + 2]]:[[#]]: error: expected a pixel to be used inside its update
    // GIVEN: errors-kept.cpp:[[#@LINE + 1]]:7: note: the update is here
    (*update(state().image, {i, 2}, [&](Pixel &p) { return &p; })).z = 7;
#elif CASE == 3
    const float *z;
    update(state().image, {i, 2}, [&](Pixel &p) { z = &p.z; });
    // READ: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
    state().out[0] = int(*z);
#elif CASE == 4
    Keeper keeper{i, nullptr};
    update(state().image, {i, 2}, [&](Pixel &p) { keeper.pixel = &p; });
    // STRUCT: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
    keeper.pixel->samples[i % 3] = float(keeper.n);
#elif CASE == 5
    Pixel *kept = nullptr;
    update(state().image, {i, 2}, [&](Pixel &p) {
      if (p.count > 3)
        kept = &p;
    });
    // CHOSEN: errors-kept.cpp:[[#@LINE + 2]]:[[#]]: error: expected a pixel to be used inside its update
    if (kept)
      kept->count = 0;
#elif CASE == 6
    // From one round of a loop to the next.
    Pixel before, *last = &before;
    for (int k = 0; k < 4; ++k) {
      // LOOP: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
      last->count = k;
      update(state().image, {i, k}, [&](Pixel &p) { last = &p; });
    }
#elif CASE == 7
    int *count;
    update(state().image, {i, 2}, [&](Pixel &p) { count = &p.count; });
    // ATOMIC: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
    piko::atomicAdd(*count, 1);
#elif CASE == 8
    const Pixel &seen = state().image({i, 2});
    // IMAGE: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: not supported in Piko: changing a pixel through the reference that image(xy) gives; write image.store or update
    const_cast<Pixel &>(seen).count = 7;
#elif CASE == 9
    Pixel *kept;
    update(state().image, {i, 2}, [&](Pixel &p) { kept = &p; });
    add(*kept, 3);
#elif CASE == 10
    parallelFor(4, [&](int k) {
      Pixel *kept;
      update(state().image, {i, k}, [&](Pixel &p) { kept = &p; });
      // ITERATION: errors-kept.cpp:[[#@LINE + 1]]:[[#]]: error: expected a pixel to be used inside its update
      kept->z = 2;
    });
#else
    // In loops, by references within the function, and by value.
    for (int k = 0; k < 4; ++k) {
      Pixel seen = update(state().image, {i, k}, [&](Pixel &p) -> Pixel & {
        Pixel *same = p.count > 3 ? &p : nullptr;
        Keeper keeper{i, &p};
        if (same)
          same->z = 0;
        add(*keeper.pixel, k);
        for (float &sample : p.samples)
          sample += p.z;
        piko::atomicAdd(p.count, 2);
        return p;
      });
      seen.count += 5;
      state().out[k] = seen.count;
    }
    piko::atomicAdd(state().image({i, 0}).count, 1);
    parallelFor(4, [&](int k) {
      int before = update(state().image, {i, k}, [&](Pixel &p) {
        int count = p.count;
        p = Pixel{};
        return count;
      });
      piko::atomicAdd(state().out[k], before);
    });
#endif
  }
};
struct Pipeline : piko::Pipe<State> {
  Stage stage;
  Pipeline() { source(stage); }
};
