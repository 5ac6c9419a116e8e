// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-hoist-bounds))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

// for (i = 0; i < 64; ++i) out[x + (i << 3)] = in[(x + i / 8) * w + (i & 7)]; the
// ranges of quotients and shifts by constants, and of masked numbers, are known.
// CHECK-LABEL: piko.kernel @kernel_a
// CHECK-COUNT-2: piko.extent
// CHECK:         scf.if
// CHECK:           piko.load checked @in
// CHECK:           piko.store %{{.*}}, checked @out
// CHECK:         } else {
// CHECK:           piko.load @in
// CHECK:           piko.store %{{.*}}, @out
piko.pipeline @P rank 1 {
  piko.buffer @in : @N
  piko.buffer @out : @N
  piko.constant @width : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %three = arith.constant 3 : i32
      %seven = arith.constant 7 : i32
      %eight = arith.constant 8 : i32
      %end = arith.constant 64 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %w = piko.load @width "x" : i32
      %last = scf.while (%i = %zero) : (i32) -> i32 {
        %more = arith.cmpi slt, %i, %end : i32
        scf.condition(%more) %i : i32
      } do {
      ^bb0(%i: i32):
        %row = arith.divsi %i, %eight : i32
        %y = arith.addi %x, %row : i32
        %first = arith.muli %y, %w : i32
        %column = arith.andi %i, %seven : i32
        %from = arith.addi %first, %column : i32
        %v = piko.load @in[%from : i32] "v" : f32
        %far = arith.shli %i, %three : i32
        %to = arith.addi %x, %far : i32
        piko.store %v, @out[%to : i32] "v" : f32
        %next = arith.addi %i, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}
