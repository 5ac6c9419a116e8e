// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a run is fixed to is folded, and tested by the runtime.
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.shadows=0,settings.bias=-1.5,albedo=0.25,weights.w[1]=3,lights.size=2}))' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-fix-constants{values=settings.shadows=0,lights.size=2}))' | piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu | FileCheck %s --check-prefix=CPU

piko.record @Settings {"shadows" : i32 at 0, "bias" : f64 at 8} size 16 align 8
piko.record @float {"value" : f32 at 0} size 4 align 4
piko.record @Weights {"w" : i16[3 : 2] at 0} size 6 align 2

// CPU-LABEL: func.func private @Fixed.kernel_a
// CPU-NOT: llvm.call @cosf
// CPU-LABEL: func.func @Fixed.setup
// CPU-COUNT-2: llvm.call @pikoir_declare_fixed(
// CHECK-LABEL: piko.pipeline @Fixed
piko.pipeline @Fixed rank 1 {
  // CHECK: piko.constant @settings
  // CHECK-DAG: piko.fixed @settings "shadows" = 0 : i32
  // CHECK-DAG: piko.fixed @settings "bias" = -1.500000e+00 : f64
  piko.constant @settings : @Settings
  // CHECK: piko.fixed @albedo "value" = 2.500000e-01 : f32
  piko.constant @albedo : @float
  // CHECK: piko.fixed @weights "w"[1] = 3 : i16
  piko.constant @weights : @Weights
  // CHECK: piko.fixed @lights = 2 : index
  piko.buffer @lights : @float
  piko.buffer @out : @float
  piko.source @a
  piko.stage @a bins [0] threads 1 : @float -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@float>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %two = arith.constant 2 : index
      %none = arith.constant 0 : i32
      // CHECK-NOT: piko.load @settings
      %shadows = piko.load @settings "shadows" : i32
      %bias = piko.load @settings "bias" : f64
      // CHECK-NOT: piko.load @albedo
      %albedo = piko.load @albedo "value" : f32
      // CHECK: %[[W:.*]] = arith.constant 3 : i16
      %second = piko.load @weights "w"[%one] : i16
      // Another element is loaded.
      // CHECK: piko.load @weights "w"
      %third = piko.load @weights "w"[%two] : i16
      // CHECK-NOT: piko.extent
      %n = piko.extent @lights[0]
      %any = arith.cmpi ne, %shadows, %none : i32
      %x = scf.if %any -> f32 {
        %c = math.cos %albedo : f32
        scf.yield %c : f32
      } else {
        scf.yield %albedo : f32
      }
      piko.store %x, @out[%n : index] "value" : f32
      piko.return
    }
  }
}
