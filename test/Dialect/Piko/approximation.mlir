// RUN: piko-opt %s | piko-opt | FileCheck %s
// Approximations of a number, and of each one of a vector.

// CHECK-LABEL: func.func @approximate
func.func @approximate(%x: f32, %xs: vector<16xf32>) -> (f32, vector<16xf32>, f32, vector<16xf32>, f32) {
  // CHECK: piko.approximate_reciprocal %{{.*}} : f32
  %a = piko.approximate_reciprocal %x : f32
  // CHECK: piko.approximate_reciprocal %{{.*}} : vector<16xf32>
  %b = piko.approximate_reciprocal %xs : vector<16xf32>
  // CHECK: piko.approximate_rsqrt %{{.*}} : f32
  %c = piko.approximate_rsqrt %x : f32
  // CHECK: piko.approximate_rsqrt %{{.*}} : vector<16xf32>
  %d = piko.approximate_rsqrt %xs : vector<16xf32>
  // CHECK: piko.approximate_sqrt %{{.*}} : f32
  %e = piko.approximate_sqrt %x : f32
  return %a, %b, %c, %d, %e : f32, vector<16xf32>, f32, vector<16xf32>, f32
}
