// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-hoist-loads))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4
piko.record @I {"value" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
piko.pipeline @P rank 1 {
  piko.constant @width : @I value [32 : i32]
  piko.buffer @widths : @I
  piko.buffer @out : @N
  piko.source @fixed
  piko.source @indexed

  // The bound, and what is computed from it, are in front; the loop no longer
  // hands the number on.
  // CHECK:      piko.kernel @kernel_fixed
  // CHECK:        %[[X:.*]] = piko.get %{{.*}} "x"
  // CHECK:        %[[W:.*]] = piko.load @width "value" : i32
  // CHECK:        %[[LAST:.*]] = arith.subi %[[W]], %{{.*}} : i32
  // CHECK:        scf.while (%[[I:.*]] = %{{.*}}) : (i32) -> i32 {
  // CHECK-NEXT:     %[[MORE:.*]] = arith.cmpi slt, %[[I]], %[[LAST]] : i32
  // CHECK-NEXT:     scf.condition(%[[MORE]]) %[[I]] : i32
  // CHECK:          arith.muli %[[X]], %[[W]]
  piko.stage @fixed bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %half = arith.constant 5.0e-01 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %end:2 = scf.while (%i = %zero) : (i32) -> (i32, i32) {
        %w = piko.load @width "value" : i32
        %last = arith.subi %w, %one : i32
        %more = arith.cmpi slt, %i, %last : i32
        scf.condition(%more) %w, %i : i32, i32
      } do {
      ^bb0(%w: i32, %i: i32):
        %row = arith.muli %x, %w : i32
        %at = arith.addi %row, %i : i32
        piko.store %half, @out[%at : i32] "v" : f32
        %next = arith.addi %i, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }

  // An element of a buffer is tested, and stays.
  // CHECK:      piko.kernel @kernel_indexed
  // CHECK:        scf.while
  // CHECK-NEXT:     piko.load @widths
  piko.stage @indexed bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %half = arith.constant 5.0e-01 : f32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %end = scf.while (%i = %zero) : (i32) -> i32 {
        %w = piko.load @widths[%x : i32] "value" : i32
        %more = arith.cmpi slt, %i, %w : i32
        scf.condition(%more) %i : i32
      } do {
      ^bb0(%i: i32):
        piko.store %half, @out[%i : i32] "v" : f32
        %next = arith.addi %i, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}
