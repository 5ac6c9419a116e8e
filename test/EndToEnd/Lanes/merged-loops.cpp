// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Nests of loops that are merged into one, of which lanes elect what they do in a
// turn: marches in a distance field, random walks, Newton's method, searches in a
// function that returns early, loops in both sides of a condition and behind one, wide
// numbers, an array that loops share, a loop beside the inner one, three loops with
// `continue` and `break`, loops that are seldom entered, iterations of a list, and an
// index that is outside.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Marches --domain 8 8 --count 203
// CASE: --pipe Walks --domain 8 8 --count 333
// CASE: --pipe Roots --domain 8 8 --count 300
// CASE: --pipe Searches --domain 8 8 --count 500
// CASE: --pipe Sides --domain 8 8 --count 300
// CASE: --pipe Behind --domain 8 8 --count 300
// CASE: --pipe Wide --domain 8 8 --count 300
// CASE: --pipe Stacks --domain 8 8 --count 300
// CASE: --pipe Beside --domain 8 8 --count 300
// CASE: --pipe Three --domain 8 8 --count 200
// CASE: --pipe Seldom --domain 8 8 --count 700
// CASE: --pipe Seldom --domain 8 8 --count 3
// CASE: --pipe Each --domain 16 16 --count 5
// CASE: --pipe Members --domain 16 16 --count 5
//
// RUN: %compare_targets %s --stops --pipe Leaves --domain 8 8 --count 60 --runs 1
//
// All of them merged, whatever is expected of that.
// DEFINE: %{pipe} =
// DEFINE: %{lanes} = 8
// DEFINE: %{merge} = pikoc %s --pipe %{pipe} --emit=machine | piko-opt --piko-to-cpu='lanes=%{lanes} merge-gain=1000' -o %t.mlir 2>&1 | FileCheck %s
// DEFINE: %{compare} = piko-compare %t.mlir --pipe %{pipe} --reference %s --domain 8 8 --count 203 --runs 1 --threads 2
// CHECK: lanes go on in this loop each by itself, and do what is around the loop inside when enough of them are done with that
//
// REDEFINE: %{pipe} = Marches
// RUN: %{merge}
// RUN: %{compare}
// REDEFINE: %{pipe} = Walks
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Roots
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Searches
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Sides
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Behind
// RUN: %{merge}
// RUN: %{compare}
// REDEFINE: %{pipe} = Wide
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Stacks
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Beside
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Three
// RUN: %{merge}
// RUN: %{compare}
// REDEFINE: %{pipe} = Seldom
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
// REDEFINE: %{pipe} = Each
// RUN: %if all %{ %{merge} %}
// RUN: %if all %{ %{compare} %}
//
// REDEFINE: %{pipe} = Members
// RUN: %{merge}
// RUN: %{compare}
//
// REDEFINE: %{pipe} = Leaves
// RUN: %{merge}
// RUN: piko-compare %t.mlir --pipe Leaves --reference %s --stops --domain 8 8 --count 60 --runs 1
//
// REDEFINE: %{lanes} = 4
// REDEFINE: %{pipe} = Sides
// RUN: %{merge}
// RUN: %{compare}
#include <piko.h>

#include <cstdint>

struct Prim {
  int x, y, z, w, serial;
};
struct Result {
  int a, b;
};
struct State {
  piko::Buffer<Result> results;
  piko::Buffer<Prim> prims;
  piko::Image<int> picture;
  int size = 61;
};

template <class Body>
struct Stage : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    state().results[p.serial] = Body().run(state(), p);
  }
};
template <class Body> struct Pipe : piko::Pipe<State> {
  Stage<Body> stage;
  Pipe() {
    source(stage);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};

inline uint32_t mix(uint32_t x) {
  x = (x ^ x >> 16) * 0x45d9f3bu;
  return (x ^ x >> 16) * 0x45d9f3bu;
}
inline float unit(uint32_t x) { return float(x >> 8) * 0x1p-24f; }

/// What is done between inner loops takes long.
inline float shade(float a, float b) {
  float c =
      piko::sin(a) * piko::cos(b) + piko::sin(b * 1.5f) * piko::cos(a * 0.5f);
  float d = piko::exp(-c * c) + piko::sqrt(c * c + 1) / (2 + piko::sin(c));
  return c * 0.25f + d * piko::cos(d + a);
}

/// Rays that are scattered.
struct March {
  static float distance(glm::vec3 p) {
    glm::vec3 q(piko::abs(p.x) - 0.7f, piko::abs(p.y) - 0.5f,
                piko::abs(p.z) - 0.6f);
    float length = piko::sqrt(glm::dot(q, q));
    return piko::min(length - 0.4f, p.y + 1.5f);
  }
  Result run(const State &, const Prim &p) {
    float sum = 0;
    int marched = 0;
    for (int sample = 0; sample < 3; ++sample) {
      uint32_t seed = mix(uint32_t(p.x) + uint32_t(sample));
      glm::vec3 o(unit(seed) * 2 - 1, 2, unit(mix(seed)) * 2 - 1), d(0, -1, 0);
      for (int bounce = 0; bounce < 4; ++bounce) {
        float t = 0.02f;
        bool isHit = false;
        for (int step = 0; step < 60; ++step) {
          float near = distance(o + d * t);
          ++marched;
          if (near < 0.01f) {
            isHit = true;
            break;
          }
          t += near;
          if (t > 9)
            break;
        }
        if (!isHit) {
          sum += d.y;
          break;
        }
        o = o + d * (t - 0.05f);
        seed = mix(seed + 1);
        float angle = unit(seed) * 6.28f, high = shade(o.x, o.z) * 0.1f;
        d = glm::vec3(piko::cos(angle) * 0.6f, 0.7f + high,
                      piko::sin(angle) * 0.6f);
        sum += shade(angle, t);
      }
    }
    return {int(sum * 256), marched};
  }
};
struct Marches : Pipe<March> {};

/// do ... while in while, with a break in the outer one.
struct Walk {
  Result run(const State &, const Prim &p) {
    uint32_t seed = mix(uint32_t(p.y));
    float total = 0;
    int walks = 0, steps = 0;
    while (true) {
      float at = 0;
      do {
        seed = seed * 1664525u + 1013904223u;
        at += unit(seed) - 0.4f;
        ++steps;
      } while (piko::abs(at) < 2.5f);
      total += shade(at, total);
      if (++walks > (p.z & 7) || total > 20)
        break;
    }
    return {int(total * 64), steps};
  }
};
struct Walks : Pipe<Walk> {};

/// Newton's method, from several places.
struct Newton {
  Result run(const State &, const Prim &p) {
    float sum = 0;
    int steps = 0;
    for (int root = 0; root < 4; ++root) {
      float a = 1 + float(p.x >> root & 31), x = a, change = 1;
      while (piko::abs(change) > 1e-4f) {
        change = (x * x - a) / (2 * x);
        x -= change;
        ++steps;
      }
      sum += shade(x, a);
    }
    return {int(sum * 128), steps};
  }
};
struct Roots : Pipe<Newton> {};

/// A function that returns from within its loop.
struct Search {
  static int find(uint32_t key, uint32_t limit) {
    for (uint32_t i = 0; i < limit; ++i) {
      key = key * 747796405u + 2891336453u;
      if ((key >> 28) == 5)
        return int(i);
    }
    return -1;
  }
  Result run(const State &, const Prim &p) {
    float sum = 0;
    int last = 0;
    for (int i = 0; i < 5; ++i) {
      int found = find(mix(uint32_t(p.x + i * 31)), 40);
      if (found < 0)
        break;
      sum += shade(float(found), float(i));
      last = found;
    }
    return {int(sum * 64), last};
  }
};
struct Searches : Pipe<Search> {};

/// Loops in both sides of a condition: the longer one is merged.
struct Side {
  Result run(const State &, const Prim &p) {
    float sum = 0;
    int turns = 0;
    for (int i = 0; i < 6; ++i) {
      uint32_t n = mix(uint32_t(p.y * 7 + i));
      float x = unit(n);
      if (n & 1) {
        while (x < 40 && turns < 500) {
          x = x * 1.25f + unit(n) * 0.5f;
          n = n * 5 + 1;
          ++turns;
        }
        sum += x;
      } else {
        for (uint32_t m = n & 15; m > 0; m >>= 1)
          ++turns;
        sum -= x;
      }
      sum += shade(x, sum);
    }
    return {int(sum * 32), turns};
  }
};
struct Sides : Pipe<Side> {};

/// A loop behind two conditions, with something else in their other sides.
struct Guarded {
  Result run(const State &state, const Prim &p) {
    float sum = 0;
    int turns = 0;
    for (int i = 0; i < (p.z & 15); ++i) {
      float a = unit(mix(uint32_t(p.x ^ i))), b = a * 2 - 0.5f;
      if (b > 0) {
        a += b;
        if ((p.w >> i & 3) != 0) {
          float at = a;
          while (at < float(state.size)) {
            at = at * 1.5f + b;
            ++turns;
          }
          a = at - b;
        } else {
          a = b * 0.5f;
        }
      } else {
        a = -a;
      }
      sum += shade(a, b);
    }
    return {int(sum * 64), turns};
  }
};
struct Behind : Pipe<Guarded> {};

/// Numbers of 64 bits, and truth values, that loops carry.
struct Wider {
  Result run(const State &, const Prim &p) {
    int64_t big = int64_t(p.x) * 1000003;
    double sum = 0.5;
    bool isOdd = false;
    int turns = 0;
    for (int i = 0; i < 5; ++i) {
      uint64_t n = uint64_t(big) ^ uint64_t(i) << 40;
      bool flip = isOdd;
      while ((n & 7) != 3 && turns < 400) {
        n = n * 6364136223846793005u + 1442695040888963407u;
        n ^= n >> 33;
        flip = !flip;
        sum += double(n & 255) * 0.125;
        ++turns;
      }
      isOdd = flip != ((n >> 20 & 1) != 0);
      big += int64_t(n >> 12) * (isOdd ? 3 : -5);
      sum += double(shade(float(n & 63), float(turns & 31)));
      sum = sum / 3.0 + 1.0 / (sum * sum + 1.0);
    }
    return {int(sum * 1024) ^ int(big >> 7), turns * 2 + int(isOdd)};
  }
};
struct Wide : Pipe<Wider> {};

/// An array that both loops use.
struct Stacked {
  Result run(const State &, const Prim &p) {
    int stack[16];
    float sum = 0;
    int visited = 0;
    for (int root = 1; root < 4; ++root) {
      int top = 0;
      stack[top++] = root;
      while (top > 0) {
        uint32_t node = uint32_t(stack[--top]);
        uint32_t key = mix(node ^ uint32_t(p.x));
        ++visited;
        sum += unit(key);
        if (node < 500 && (key & 3) != 0)
          stack[top++] = int(node * 2);
        if (node < 500 && (key & 12) == 4)
          stack[top++] = int(node * 2 + 1);
      }
      sum += shade(sum, float(root));
    }
    return {int(sum * 256), visited};
  }
};
struct Stacks : Pipe<Stacked> {};

/// A loop that all lanes go through together stands beside the inner one.
struct Neighbour {
  Result run(const State &state, const Prim &p) {
    float sum = 0;
    int turns = 0;
    for (int i = 0; i < (p.w & 7); ++i) {
      float x = unit(mix(uint32_t(p.x + i)));
      for (int k = 0; k < state.size / 16; ++k)
        x = x * 0.75f + float(k) * 0.125f;
      while (x < 30) {
        x = x * 1.4f + 0.1f;
        ++turns;
      }
      for (int k = 0; k < 3; ++k)
        x += shade(x, float(k));
      sum += x;
    }
    return {int(sum * 64), turns};
  }
};
struct Beside : Pipe<Neighbour> {};

/// Three loops, with `continue` and `break` in each.
struct Nest {
  Result run(const State &, const Prim &p) {
    uint32_t n = mix(uint32_t(p.serial));
    float sum = 1;
    int turns = 0;
    for (int i = 0; i < 6; ++i) {
      n = mix(n + uint32_t(i));
      if ((n & 7) == 1)
        continue;
      for (int j = 0; j < int(n >> 29) + 1; ++j) {
        float x = unit(mix(n ^ uint32_t(j)));
        while (true) {
          x = x * 1.3f + 0.2f;
          ++turns;
          if (x < 1)
            continue;
          if (x > 25 || (turns & 127) == 77)
            break;
          x += 0.01f;
        }
        sum += shade(x, sum);
        if (sum < 0)
          break;
      }
      if (turns > 300)
        break;
      sum = sum * 0.5f + shade(sum, float(i));
    }
    return {int(sum * 512), turns};
  }
};
struct Three : Pipe<Nest> {};

/// Loops that few primitives enter, some never.
struct Enter {
  Result run(const State &, const Prim &p) {
    float sum = 0;
    int turns = 0;
    int many = (p.x & 3) == 0 ? p.y & 7 : 0;
    for (int i = 0; i < many; ++i) {
      uint32_t m = uint32_t(p.z) >> (i * 4 & 31) & 15;
      float x = float(m);
      while (m > 8) {
        m -= 3;
        x = x * 0.5f + 1;
        ++turns;
      }
      sum += shade(x, float(m));
    }
    return {int(sum * 64), turns};
  }
};
struct Seldom : Pipe<Enter> {};

/// Iterations of a call that takes a list.
struct Pixels : piko::Stage<16, 16, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) { assignToAll(p); }
  void schedule(piko::BinId) { everyBin(); }
  void process(const piko::List<Prim> &list) {
    int count = int(list.size());
    parallelForPixels([&](glm::ivec2 at) {
      float sum = 0;
      int turns = 0;
      for (int i = 0; i < 3; ++i) {
        uint32_t n = mix(uint32_t(at.x * 31 + at.y * 1013 + i * 7 + count));
        float x = unit(n) * 0.5f;
        while (x < 12) {
          x = x * 1.35f + 0.05f;
          ++turns;
        }
        sum += shade(x, float(i));
      }
      update(state().picture, at,
             [&](int &pixel) { pixel = int(sum * 64) * 31 + turns; });
    });
  }
};
struct Each : piko::Pipe<State> {
  Pixels pixels;
  Each() {
    source(pixels);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};

/// Members of the list, which are read before the inner loop and after it.
struct Member : piko::Stage<16, 16, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) { assignToAll(p); }
  void process(const piko::List<Prim> &list) {
    int count = int(list.size());
    parallelForPixels([&](glm::ivec2 at) {
      float sum = 0;
      for (int i = 0; i < 3; ++i) {
        const Prim &q =
            list[int(uint32_t(at.x * 3 + at.y + i) % uint32_t(count))];
        float x = unit(mix(uint32_t(q.x)));
        while (x < float(4 + (q.y & 7)))
          x = x * 1.35f + 0.05f;
        sum += shade(x, float(q.w & 15));
      }
      update(state().picture, at, [&](int &pixel) { pixel = int(sum * 64); });
    });
  }
};
struct Members : piko::Pipe<State> {
  Member member;
  Members() {
    source(member);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};

/// A walk that leaves the buffer.
struct Leave : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    float sum = 0;
    int at = p.serial % 5;
    for (int i = 0; i < 4; ++i) {
      float x = unit(mix(uint32_t(p.x + i)));
      while (x < 9) {
        x = x * 1.5f + 0.1f;
        at += 3;
      }
      sum += shade(x, float(state().prims[at].y & 7));
    }
    state().results[p.serial] = {int(sum), at};
  }
};
struct Leaves : piko::Pipe<State> {
  Leave leave;
  Leaves() {
    source(leave);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};
