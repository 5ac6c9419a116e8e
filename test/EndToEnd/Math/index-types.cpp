// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Fields of all integer types and of enumerations are indices of buffers.
// RUN: %compare_targets %s --count 200 --runs 2 --threads 1 2 | FileCheck %s
// CHECK: equal
#include <piko.h>

enum class Small : int8_t { A, B };
enum Plain { C, D };
enum class Large : uint64_t { E };

struct Item {
  bool truth;
  char letter;
  int8_t i8;
  uint8_t u8;
  int16_t i16;
  uint16_t u16;
  int32_t i32;
  uint32_t u32;
  int64_t i64;
  uint64_t u64;
  Small small;
  Plain plain;
  Large large;
  int16_t list[2];
};
struct Seed {
  int row;
};
struct State {
  piko::Buffer<int> numbers;
  piko::Buffer<int> sums;
  piko::Image<int> image;
};

struct Make : piko::Stage<0, 0, 64, Seed, Item>, piko::Uses<State> {
  void process(const Seed &seed) {
    int i = seed.row;
    int n = int(state().numbers.size());
    int at = i % (n < 100 ? n : 100);
    emit(Item{n > 1 && i % 2 == 1,
              char(at),
              int8_t(at),
              uint8_t(at),
              int16_t(at),
              uint16_t(at),
              at,
              uint32_t(at),
              at,
              uint64_t(at),
              Small(at),
              Plain(at),
              Large(at),
              {int16_t(at), 0}});
  }
};
struct Read : piko::Stage<8, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &i) {
    assignToBin(i, binFromPosition(glm::ivec2(i.i32 % 8, 0)));
  }
  void process(const Item &i) {
    auto &n = state().numbers;
    int sum = n[i.truth] + 2 * n[i.letter] + 3 * n[i.i8] + 4 * n[i.u8] +
              5 * n[i.i16] + 6 * n[i.u16] + 7 * n[i.i32] + 8 * n[i.u32] +
              9 * n[i.i64] + 10 * n[i.u64] + 11 * n[int(i.small)] +
              12 * n[i.plain] + 13 * n[int64_t(i.large)] + 14 * n[i.list[0]];
    piko::atomicAdd(state().sums[i.i16], sum);
    update(state().image, binLo(),
           [&](int &pixel) { pixel = pixel * 31 + n[i.i8]; });
  }
};
struct Pipeline : piko::Pipe<State> {
  Make make;
  Read read;
  Pipeline() {
    source(make);
    connect(make, 0, read);
  }
};
