// RUN: piko-opt %s | piko-opt | FileCheck %s
// What C++ calls the types of a record is kept for hosts.

// CHECK: piko.record @Light {{.*}} size 80 align 16 {piko.cpp_types = {
// CHECK-SAME: color = "glm::vec3",
// CHECK-SAME: flags = "uint16_t[2][4]",
// CHECK-SAME: kind = {scoped, type = "Kind", underlying = "uint8_t", values = {Point = 0 : i64, Spot = 1 : i64}},
// CHECK-SAME: parts = {align = 8 : i64, size = 8 : i64, type = "ns::Part[2]"},
// CHECK-SAME: turn = "glm::dquat"}}
piko.record @Light {"color.x" : f32 at 0, "color.y" : f32 at 4,
                    "color.z" : f32 at 8, "kind" : i8 at 12,
                    "flags" : i16[2 : 8, 4 : 2] at 16,
                    "parts.on" : i8[2 : 8, 3 : 1] at 32,
                    "turn.x" : f64 at 48, "turn.y" : f64 at 56,
                    "turn.z" : f64 at 64, "turn.w" : f64 at 72}
  size 80 align 16
  {piko.cpp_types = {color = "glm::vec3", flags = "uint16_t[2][4]",
                     kind = {type = "Kind", underlying = "uint8_t", scoped,
                             values = {Point = 0, Spot = 1}},
                     parts = {type = "ns::Part[2]", size = 8, align = 8},
                     turn = "glm::dquat"}}

// CHECK: piko.record @"glm::mat<3, 2, float>" {{.*}} {piko.cpp_types = {this = "glm::mat3x2"}}
piko.record @"glm::mat<3, 2, float>" {"value.x" : f32[3 : 8] at 0,
                                      "value.y" : f32[3 : 8] at 4}
  size 24 align 4 {piko.cpp_types = {this = "glm::mat3x2"}}

// CHECK: piko.record @"unsigned int" {{.*}} {piko.cpp_types = {value = "uint32_t"}}
piko.record @"unsigned int" {"value" : i32 at 0} size 4 align 4
  {piko.cpp_types = {value = "uint32_t"}}
