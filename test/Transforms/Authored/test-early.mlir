// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-test-early))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.buffer @lights : @N
  piko.image @depth : @N rank 1
  piko.image @color : @N rank 1
  piko.source @shade
  piko.stage @shade bins [8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    // The loop over lights reads only what the phase leaves alone; the old colour
    // is what an update may change, and is read where it was.
    // CHECK:      piko.process
    // CHECK-NOT:    scf.for
    // CHECK:        piko.load @color
    // CHECK-NOT:    scf.for
    // CHECK:        %[[PASSED:.*]] = piko.update @depth
    // CHECK:        scf.if %[[PASSED]] {
    // CHECK:          %[[SUM:.*]] = scf.for
    // CHECK:            piko.load @lights
    // CHECK:          arith.mulf %[[SUM]]
    // CHECK:          piko.update @color
    // expected-remark @below {{operations run only where they are needed}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %none = arith.constant 0.0 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %n = piko.extent @lights[0]
      %sum = scf.for %i = %zero to %n step %one iter_args(%s = %none) -> f32 {
        %l = piko.load @lights[%i : index] "v" : f32
        %t = arith.addf %s, %l : f32
        scf.yield %t : f32
      }
      %before = piko.load @color[%x : i32] "v" : f32
      %scaled = arith.mulf %sum, %z : f32
      %c = arith.addf %scaled, %before : f32
      %passed = piko.update @depth[%x : i32] {
      ^bb0(%old: f32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new : f32] results [%less : i1]
      } -> i1
      scf.if %passed {
        piko.update @color[%x : i32] {
        ^bb0(%old: f32):
          piko.yield [%c : f32]
        }
      }
      piko.return
    }
  }
}
