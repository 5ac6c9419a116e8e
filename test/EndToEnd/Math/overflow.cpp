// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Tests of whether a sum, a difference or a product leaves its type, of which an
// optimizer makes operations with overflow.
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: %if all %{ piko-compare %s --cases %s --runs 1 --without vectorize -O0 %}
// CASE: --pipe Narrow --count 640 --wide
// CASE: --pipe Wide --count 640 --wide
#include <piko.h>

#include <limits>
#include <type_traits>

template <class T> struct Prim {
  T a, b;
  int serial;
};
struct Out {
  uint64_t bits;
};
struct State {
  piko::Buffer<Out> out;
};

template <class T>
struct Stage : piko::Stage<0, 0, 64, Prim<T>>, piko::Uses<State> {
  void process(const Prim<T> &p) {
    constexpr T most = std::numeric_limits<T>::max();
    T a = p.a >> (p.b & 31), b = p.b >> (p.a & 15);
    uint64_t bits = 0;
    bits |= uint64_t(b > 0 ? a <= most / b : true);
    bits |= uint64_t(b != 0 && a > most / b) << 1;
    bits |= uint64_t(a > most - b) << 2;
    bits |= uint64_t(a + b < a) << 3;
    bits |= uint64_t(a < b) << 4;
    T product = a * b;
    bits |= uint64_t(b != 0 && product / b != a) << 5;
    using Signed = std::make_signed_t<T>;
    Signed sum, difference, signedProduct;
    bits |= uint64_t(__builtin_add_overflow(Signed(a), Signed(b), &sum)) << 6;
    bits |=
        uint64_t(__builtin_sub_overflow(Signed(a), Signed(p.b), &difference))
        << 7;
    bits |=
        uint64_t(__builtin_mul_overflow(Signed(a), Signed(b), &signedProduct))
        << 8;
    bits ^= uint64_t(sum) ^ uint64_t(difference) << 9 ^
            uint64_t(signedProduct) << 11;
    state().out[p.serial].bits = bits << 32 | uint32_t(product);
  }
  State &state() { return piko::Uses<State>::state(); }
};

template <class T> struct Pipe : piko::Pipe<State> {
  Stage<T> stage;
  Pipe() {
    this->source(stage);
    this->allocateForSource(this->state().out, 0);
  }
};
struct Narrow : Pipe<uint32_t> {};
struct Wide : Pipe<uint64_t> {};
