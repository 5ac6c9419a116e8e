// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units),piko-reduce-updates,canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "z" : f32 at 4, "n" : i32 at 8} size 12 align 4
piko.record @Z {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @C {"v" : f32[2 : 4] at 0, "w" : i32 at 8} size 12 align 4

// A pixel that is nearer is noted with its unit; what it carries along goes with
// it.
// CHECK-LABEL: piko.pipeline @Nearest
// CHECK:         piko.image @depth.unit : @piko.unit rank 1 internal
// CHECK:         piko.stage @a {{.*}} split
// CHECK:         scf.forall (%[[U:.*]]) in
// CHECK:           %[[W:.*]] = piko.cpu.open_writer %{{.*}}[%[[U]]]
// CHECK-DAG:       %[[S:.*]] = piko.cpu.private_images @depth by [0] ["olt"] carries [@color] keeps [array<i64: 0>, array<i64: 0, 2>] unit @depth.unit of %[[W]]
// CHECK-DAG:       %[[I:.*]] = arith.index_cast %[[U]] : index to i32
// CHECK:           %[[K:.*]] = piko.update @depth[
// CHECK:           scf.if %[[K]]
// CHECK:             scf.if %[[S]]
// CHECK:               piko.update @depth.unit
// CHECK:               piko.yield[%[[I]] : i32]
// CHECK:             piko.update @color
piko.pipeline @Nearest rank 1 {
  piko.image @depth : @Z rank 1
  piko.image @color : @C rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-remark @below {{stage 'a' selects pixels of private images, which are combined when its kernel ends: 'depth', 'color'}}
      %nearer = piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %n: i32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new, %n : f32, i32] results [%less : i1]
      } -> i1
      scf.if %nearer {
        piko.update @color[%x : i32] {
        ^bb0(%v: f32, %v1: f32, %w: i32):
          piko.yield [%z, %v1, %x : f32, f32, i32]
        }
      }
      piko.return
    }
  }
}

// The old number may come first, the choice may be the other way round, and a
// second number may decide.
// CHECK-LABEL: piko.pipeline @Keys
// CHECK:         piko.cpu.private_images @depth by [0, 1] ["ogt", "slt"] last carries [] keeps [array<i64: 0, 1>] unit @depth.unit
piko.pipeline @Keys rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %true = arith.constant true
      // expected-remark @below {{stage 'a' selects pixels of private images}}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %farther = arith.cmpf olt, %old, %z : f32
        %equal = arith.cmpf oeq, %old, %z : f32
        %less = arith.cmpi sge, %m, %n : i32
        %both = arith.andi %less, %equal : i1
        %first = arith.ori %both, %farther : i1
        %not = arith.xori %first, %true : i1
        %new = arith.select %not, %old, %z : f32
        %count = arith.select %not, %m, %n : i32
        piko.yield [%new, %count : f32, i32]
      }
      piko.return
    }
  }
}

// What is overwritten anyway is the last.
// CHECK-LABEL: piko.pipeline @Painted
// CHECK:         %[[S:.*]] = piko.cpu.private_images @color by [] [] last carries [] keeps [array<i64: 2>] unit @color.unit
// CHECK:         piko.update @color[
// CHECK:         scf.if %[[S]]
// CHECK:           piko.update @color.unit[
piko.pipeline @Painted rank 1 {
  piko.image @color : @C rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-remark @below {{stage 'a' selects pixels of private images}}
      piko.update @color[%x : i32] {
      ^bb0(%v: f32, %v1: f32, %w: i32):
        piko.yield [%v, %v1, %x : f32, f32, i32]
      }
      piko.return
    }
  }
}

// Sums of integers need no order.
// CHECK-LABEL: piko.pipeline @Counts
// CHECK:         piko.stage @a
// CHECK-NOT:       ordered
// CHECK-SAME:      split
// CHECK-NOT:     piko.update
// CHECK:         scf.if
// CHECK:           piko.atomic add checked @depth[%{{.*}} : index] "n", %{{.*}} : i32
// CHECK:         } else {
// CHECK:           piko.fail @a in %{{.*}} outside bin of @depth
piko.pipeline @Counts rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  // expected-remark @below {{stage 'a' updates pixels of 'depth' in any order, by atomic operations}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %more = arith.addi %m, %x : i32
        piko.yield [%old, %more : f32, i32]
      }
      piko.return
    }
  }
}

// What a branch chooses may have been computed before it, or in it.
// CHECK-LABEL: piko.pipeline @Conditions
// CHECK-NOT:     piko.update
// CHECK:         %[[C:.*]] = arith.cmpi sgt
// CHECK-NOT:     piko.atomic
// CHECK:         scf.if %[[C]] {
// CHECK:           piko.atomic or checked @depth
// CHECK:         scf.if %[[C]] {
// CHECK-NEXT:      piko.atomic add checked @both
// CHECK-NOT:     piko.atomic
piko.pipeline @Conditions rank 1 {
  piko.image @depth : @Z rank 1
  piko.image @both : @Z rank 1
  piko.source @a
  // expected-remark @below {{stage 'a' updates pixels of 'depth' in any order}}
  // expected-remark @below {{stage 'a' updates pixels of 'both' in any order}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %c = arith.cmpi sgt, %x, %n : i32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %new = scf.if %c -> (i32) {
          %more = arith.ori %m, %x : i32
          scf.yield %more : i32
        } else {
          scf.yield %m : i32
        }
        piko.yield [%old, %new : f32, i32]
      }
      piko.update @both[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %more = arith.addi %m, %x : i32
        %new = scf.if %c -> (i32) {
          scf.yield %more : i32
        } else {
          scf.yield %m : i32
        }
        piko.yield [%old, %new : f32, i32]
      }
      piko.return
    }
  }
}
