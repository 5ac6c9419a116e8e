// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// C++ leaves open in which order arguments are evaluated. Where that shows, the
// compiler says so, also after calls, references, pointers and captures.
// RUN: piko-translate --cpp-to-piko %s 2>&1 | FileCheck %s --implicit-check-not=warning:
#include <piko.h>

inline float rnd(uint32_t &s) {
  s = s * 747796405u + 2891336453u;
  return float(s >> 8) * 0x1p-24f;
}
inline float viaPointer(uint32_t *s) { return rnd(*s); }
struct Generator {
  uint32_t seed, calls;
  float next() { return rnd(seed); }
  float peek() const { return float(seed); }
  void count() { ++calls; }
  int getCalls() const { return int(calls); }
};
inline float touch(float &x) { return ++x; }
inline float nested(Generator &g) { return g.next() + 1; }
inline float area(const Generator &g) { return float(g.seed); }
template <class F> float twice(F f) { return f() * 2; }
struct Sum {
  float a, b;
};
struct Item {
  float x;
  uint32_t seed;
};

struct Warned : piko::Stage<0, 0, 1, Item, Item, Item> {
  uint32_t put(float x) {
    emit(Item{x, 0});
    return 1;
  }
  void process(const Item &item) {
    uint32_t s = item.seed;
    Generator g{s, 0}, other{s, 0};
    float values[2] = {};
    // CHECK: :[[#@LINE + 2]]:26: warning: 's' is changed by two arguments whose order C++ leaves open: a plain C++ build of this file may differ{{$}}
    // CHECK: :[[#@LINE + 1]]:18: note: the other argument is here; braces in the place of the parentheses are evaluated from left to right
    glm::vec3 v3(rnd(s), rnd(s), 0);
    // CHECK: :[[#@LINE + 2]]:26: warning: 's' is changed by two operands
    // CHECK: :[[#@LINE + 1]]:17: note: the other operand is here; variables of their own give them an order
    float sum = rnd(s) - rnd(s);
    // CHECK: :[[#@LINE + 1]]:45: warning: 's' is changed by two arguments
    float power = piko::min(viaPointer(&s), viaPointer(&s));
    // CHECK: :[[#@LINE + 1]]:33: warning: 'g.seed' is changed by two operands
    float method = g.next() * g.next();
    // CHECK: :[[#@LINE + 1]]:31: warning: 'g.seed' is changed by one operand and read by another
    float either = g.peek() + nested(g);
    auto captured = [&] { return rnd(s); };
    // CHECK: :[[#@LINE + 1]]:29: warning: 's' is changed by two arguments
    glm::vec2 w(captured(), captured());
    auto own = [s]() mutable { return rnd(s); };
    // CHECK: :[[#@LINE + 1]]:24: warning: 'own.s' is changed by two arguments
    glm::vec2 u(own(), own());
    // CHECK: :[[#@LINE + 2]]:41: warning: 's' is changed by two operands
    float lambdas =
        twice([&] { return rnd(s); }) + twice([&] { return rnd(s); });
    uint32_t &alias = s;
    // CHECK: :[[#@LINE + 1]]:34: warning: 's' is changed by two operands
    float aliased = rnd(alias) + rnd(s);
    // CHECK: :[[#@LINE + 1]]:44: warning: 's' is changed by one argument and read by another
    glm::vec2 mixed(static_cast<float>(s), rnd(s));
    // CHECK: :[[#@LINE + 1]]:33: warning: primitives are emitted by two operands
    uint32_t emitted = put(1) + put(2);
    for (float &value : values)
      // CHECK: :[[#@LINE + 1]]:30: warning: 'value' is changed by two operands
      value = (value += 1) + touch(value);
    // CHECK: :[[#@LINE + 1]]:51: warning: 'values[0]' is changed by two operands
    float element = (values[0] += 1) * (values[0] *= 2);

    // All this has an order, or changes nothing that the other sees.
    glm::vec3 braces{rnd(s), rnd(s), rnd(s)};
    Sum aggregate = {rnd(s), rnd(s)};
    float a = rnd(s), b = rnd(s);
    bool both = rnd(s) > 0.5f && rnd(s) > 0.5f;
    float chosen = rnd(s) > 0.5f ? rnd(s) : -rnd(s);
    float comma = (rnd(s), rnd(s));
    glm::vec2 apart(g.next(), other.next());
    glm::vec2 parts(g.getCalls(), g.next());
    float constant = area(g) + area(g) + g.peek() * area(g);
    sum += rnd(s);
    float *pointer = values;
    sum += touch(pointer[0]) + touch(pointer[1]);
    values[0] = rnd(s);
    values[int(rnd(s))] = rnd(s);
    glm::vec2 elements(values[0] += 1, values[1] += 1);
    float copies = [s]() mutable { return rnd(s); }() +
                   [s]() mutable { return rnd(s); }();
    glm::vec2 inner(glm::vec2{rnd(s), rnd(s)});
    emit(Item{v3.x + sum + power + method + either + w.x + u.x + lambdas +
                  aliased + mixed.x + element + braces.x + aggregate.a + a + b,
              uint32_t(both) + emitted});
    emit(Item{chosen + comma + apart.x + parts.x + constant + elements.x +
                  copies + inner.x,
              0},
         1);
  }
};
// What no phase calls is not judged.
inline float unused(uint32_t &s) { return rnd(s) * rnd(s); }

// A template is told of once.
template <int N> struct Template : piko::Stage<0, 0, 1, Item> {
  static float draw(uint32_t &s) {
    // CHECK: :[[#@LINE + 1]]:21: warning: 's' is changed by two operands
    return rnd(s) + rnd(s);
  }
  void process(const Item &item) {
    uint32_t s = item.seed + N;
    (void)draw(s);
  }
};
struct Pipeline : piko::Pipe<> {
  Warned warned;
  Template<1> one;
  Template<2> two;
  Pipeline() {
    source(warned);
    connect(warned, 0, one);
    connect(warned, 1, two);
  }
};
