// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-map-threads,piko-expand-remainders,piko-to-grids),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"x" : f32 at 0, "y" : f64 at 8} size 16 align 8

// 40 bits of a float, and 11 of a double, are divided at a time.
// CHECK-LABEL: piko.kernel @kernel_a
// CHECK-NOT:     arith.remf
// CHECK:         scf.if %{{.*}} -> (f32) {
// CHECK:         } else {
// CHECK:           scf.while
// CHECK:             arith.minui %{{.*}}, %c40_i64
// CHECK:             arith.remui
// CHECK:           math.copysign
// CHECK:         scf.if %{{.*}} -> (f64) {
// CHECK:             arith.minui %{{.*}}, %c11_i64
// CHECK-NOT:     arith.remf
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %y = piko.get %f "y" : !piko.prim<@F> -> f64
      %two = arith.constant 2.0 : f32
      %r = arith.remf %x, %two : f32
      %s = arith.remf %y, %y : f64
      %zero = arith.constant 0 : index
      piko.store %r, @out[%zero : index] "x" : f32
      piko.store %s, @out[%zero : index] "y" : f64
      piko.return
    }
  }
}
