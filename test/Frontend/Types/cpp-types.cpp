// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What C++ calls the types of records that the storage does not tell.
// RUN: piko-translate --cpp-to-piko %s | FileCheck %s
#include <array>
#include <glm/gtc/quaternion.hpp>
#include <piko.h>

namespace ns {
enum class Kind : short { Near = -1, Far };
enum Plain { A };
template <class T> struct Pair {
  T a, b;
};
} // namespace ns

// Only what is not signed, or has a class, is named; a class says its size
// where its fields do not.
// CHECK: piko.record @Light {{.*}} size 80 align 16 {piko.cpp_types = {
// CHECK-SAME: bits = "uint16_t[2][3]",
// CHECK-SAME: color = "glm::vec3",
// CHECK-SAME: kinds = {scoped, type = "ns::Kind[2]", underlying = "int16_t", values = {Far = 0 : i64, Near = -1 : i64}},
// CHECK-SAME: loose = "struct",
// CHECK-SAME: pair = "ns::Pair<bool>",
// CHECK-SAME: pair.a = "bool",
// CHECK-SAME: pair.b = "bool",
// CHECK-SAME: plain = {type = "ns::Plain", underlying = "uint32_t", values = {A = 0 : i64}},
// CHECK-SAME: weights = "std::array",
// CHECK-SAME: wide = {align = 16 : i64, size = 16 : i64, type = "Light::Wide"}}}
struct Light {
  glm::vec3 color;
  int signedNumber;
  unsigned short bits[2][3];
  ns::Kind kinds[2];
  struct alignas(16) Wide {
    float f;
  } wide;
  ns::Plain plain;
  ns::Pair<bool> pair;
  std::array<float, 2> weights;
  struct {
    float f;
  } loose;
};

// A class with one member is told from a number.
// CHECK: piko.record @Single {"value" : i32 at 0} {{.*}} {piko.cpp_types = {this = "Single"}}
struct Single {
  int value;
};

// CHECK: piko.record @"glm::qua<float>" {{.*}} {piko.cpp_types = {this = "glm::quat"}}
// CHECK: piko.record @"Single[2]" {{.*}} {piko.cpp_types = {value = "Single[2]"}}
// CHECK: piko.record @"ns::Pair<short>" {{.*}} size 4 align 2{{$}}
// CHECK: piko.record @"unsigned char" {{.*}} {piko.cpp_types = {value = "uint8_t"}}
// CHECK: piko.record @float {"value" : f32 at 0} size 4 align 4{{$}}
struct State {
  Light light;
  Single single;
  glm::quat turn;
  Single singles[2];
  // The buffer is the only use of its type.
  piko::Buffer<ns::Pair<short>> pairs;
  piko::Image<unsigned char> image;
};

// A stage whose symbol another piece of the pipeline has keeps its name.
// CHECK: piko.stage @light_stage {{.*}} attributes {piko.cpp_name = "light"}
struct Take : piko::Stage<0, 0, 64, float>, piko::Uses<State> {
  void process(const float &) {}
};
struct Types : piko::Pipe<State> {
  Take light;
  Types() { source(light); }
};
