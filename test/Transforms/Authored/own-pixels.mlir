// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-own-pixels{tile=16}))' %s | FileCheck %s

piko.record @F {"x" : f32 at 0, "y" : i32 at 4, "z" : f32 at 8} size 12 align 4
piko.record @Depth {"z" : f32 at 0} size 4 align 4

// What the pixel is computed from is copied before the assignment, and no
// more than that: the depth stays out.
// CHECK-LABEL: piko.pipeline @Whole
// CHECK:         piko.stage @test bins [0, 0] threads 64 tile 16
// CHECK:           piko.assign {
// CHECK-NEXT:      ^bb0(%[[F:.*]]: !piko.prim<@F>):
// CHECK-NEXT:        %[[X:.*]] = piko.get %[[F]] "x"
// CHECK-NEXT:        %[[XI:.*]] = arith.fptosi %[[X]]
// CHECK-NEXT:        %[[Y:.*]] = piko.get %[[F]] "y"
// CHECK-NEXT:        piko.owner[%[[XI]], %[[Y]] : i32, i32]
// CHECK-NEXT:        %[[BIN:.*]] = arith.constant 0 : index
// CHECK-NEXT:        piko.assign_to %[[BIN]]
piko.pipeline @Whole rank 2 {
  piko.image @depth : @Depth rank 2
  piko.source @test
  piko.stage @test bins [0, 0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %xi = arith.fptosi %x : f32 to i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.update @depth[%xi, %y : i32, i32] {
      ^bb0(%old: f32):
        piko.yield [%z : f32]
      }
      piko.return
    }
  }
}

// Bins no larger than a tile already run on one thread each.
// CHECK-LABEL: piko.pipeline @Small
// CHECK-NOT:     tile
// CHECK-NOT:     piko.owner
piko.pipeline @Small rank 2 {
  piko.image @depth : @Depth rank 2
  piko.source @test
  piko.stage @test bins [8, 8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @depth[%y, %y : i32, i32] {
      ^bb0(%old: f32):
        piko.yield [%old : f32]
      }
      piko.return
    }
  }
}
