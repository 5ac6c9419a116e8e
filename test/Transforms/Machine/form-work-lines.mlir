// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "y" : i32 at 4, "z" : i64 at 8} size 16 align 8

// The bins of the box around both ends are tested one by one: in two dimensions
// all corners may not be on one side of the line, in 128 bits.
// CHECK-LABEL: piko.pipeline @Planar
// CHECK:         piko.items of @a source 0 {
// CHECK-NEXT:    ^bb0(%[[S:.*]]: !piko.prim<@F>):
// CHECK:           scf.for %[[BY:.*]] =
// CHECK:             scf.for %[[BX:.*]] =
// CHECK:               arith.muli {{.*}} : i128
// CHECK:               %[[TOUCHES:.*]] = arith.cmpi sle, {{.*}} : i128
// CHECK-NEXT:          scf.if %[[TOUCHES]] {
// CHECK-NEXT:            piko.place %[[S]] of @a in
piko.pipeline @Planar rank 2 {
  piko.source @a
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.assign_line [%x, %x : i32, i32] to [%y, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// In one dimension a line is a box whose ends may come in any order.
// CHECK-LABEL: piko.pipeline @Linear
// CHECK:         arith.minsi
// CHECK:         arith.maxsi
// CHECK:         scf.for
// CHECK-NOT:     scf.if
// CHECK:         piko.place
piko.pipeline @Linear rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.assign_line [%x : i32] to [%y : i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// Each pair of three dimensions is tested; a coordinate that may have more than
// 32 bits is saturated.
// CHECK-LABEL: piko.pipeline @Spatial
// CHECK:         arith.maxsi %{{.*}}, %c-2147483648
// CHECK-COUNT-3: arith.cmpi sle, {{.*}} : i128
// CHECK:         piko.place
piko.pipeline @Spatial rank 3 {
  piko.source @a
  piko.stage @a bins [8, 8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> i64
      %zero = arith.constant 0 : index
      piko.assign_line [%x, %y, %z : i32, i32, i64] to [%y, %x, %zero : i32, i32, index]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
