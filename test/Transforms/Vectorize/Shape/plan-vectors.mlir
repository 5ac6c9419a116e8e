// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors))' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefixes=CHECK,SHAPED
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8 flatten=false compact=false}))' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefixes=CHECK,KEPT
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-plan-vectors))' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefixes=CHECK,SHAPED

// A loop that becomes vectors says of how many lanes, and nothing of it is a vector
// yet; short ones run a scalar copy, which is planned no more.
piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @V {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Row
// CHECK:         scf.if
// CHECK-NEXT:      scf.for
// CHECK-NOT:     vector<
// SHAPED:          } {piko.lanes, piko.vector_lanes = 16 : i64}
// KEPT:            } {piko.lanes, piko.vector_lanes = 8 : i64}
// CHECK-NEXT:    } else {
// CHECK-NEXT:      scf.for
// CHECK-NOT:     piko.lanes
// CHECK:         piko.storage.close_bins
piko.pipeline @Row rank 2 {
  piko.buffer @v : @V
  piko.image @depth : @F rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %c3 = arith.constant 3 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      scf.for %x = %c1 to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %shared = piko.load checked @v[%c3 : index] "y" : f32
        %1 = arith.mulf %f, %shared : f32
        %2 = arith.addf %1, %half : f32
        %3 = arith.mulf %2, %2 : f32
        %4 = arith.addf %3, %f : f32
        %old = piko.load checked @depth[%x, %c3 : index, index] "z" : f32
        %nearer = arith.cmpf olt, %4, %old : f32
        scf.if %nearer {
          %5 = math.sqrt %4 : f32
          %6 = arith.divf %5, %half : f32
          piko.store %6, checked @depth[%x, %c3 : index, index] "z" : f32
        }
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// A nest that lanes leave at different times is one loop, in whose iterations lanes are
// in different searches; or it stays.
piko.record @P {"k" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Searches
// SHAPED:        scf.while
// SHAPED-NOT:    scf.while
// SHAPED:        piko.iterations
// SHAPED:        piko.vector_lanes = 32 : i64
// KEPT:          scf.for %{{.*}} = %c0 to %c8
// KEPT:            scf.while
// KEPT-NOT:      piko.iterations
// KEPT:          piko.storage.close_bins
piko.pipeline @Searches rank 1 {
  piko.buffer @table : @N
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %c8 = arith.constant 8 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %all:2 = scf.while (%sum = %c0, %x = %c0) : (i32, i32) -> (i32, i32) {
          %more = arith.cmpi slt, %x, %c8 : i32
          scf.condition(%more) %sum, %x : i32, i32
        } do {
        ^bb0(%sum: i32, %x: i32):
          %first = arith.muli %k, %x : i32
          %found:2 = scf.while (%at = %first) : (i32) -> (i32, i32) {
            %0 = piko.load checked @table[%at : i32] "n" : i32
            %1 = arith.muli %0, %0 : i32
            %2 = arith.addi %1, %0 : i32
            %3 = arith.xori %2, %k : i32
            %goes = arith.cmpi sgt, %3, %k : i32
            scf.condition(%goes) %at, %0 : i32, i32
          } do {
          ^bb0(%at: i32, %0: i32):
            %next = arith.addi %at, %c1 : i32
            scf.yield %next : i32
          }
          %more = arith.addi %sum, %found#1 : i32
          %next = arith.addi %x, %c1 : i32
          scf.yield %more, %next : i32, i32
        }
        piko.store %all#0, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

// A first loop finds which iterations have something to do, a second one lists them, and
// a third one does it: the first and the third become vectors.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Compacted
// SHAPED:        memref.alloca() : memref<1024xi8>
// SHAPED:        scf.for
// SHAPED:          piko.vector_lanes = 16 : i64
// SHAPED:          piko.vector_lanes = 16 : i64
// KEPT-NOT:      memref.alloca() : memref<1024xi8>
// KEPT:          piko.storage.close_bins
piko.pipeline @Compacted rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %some = arith.cmpf ogt, %v, %two : f32
        scf.if %some {
          %sum = scf.for %y = %c0 to %n step %c1 iter_args(%s = %zero) -> f32 {
            %w = piko.load checked @in[%y : index] "z" : f32
            %d = arith.subf %w, %v : f32
            %r = math.sqrt %d : f32
            %t = arith.addf %s, %r : f32
            scf.yield %t : f32
          }
          piko.store %sum, checked @out[%x : index] "z" : f32
        }
      }
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
