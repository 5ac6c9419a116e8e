// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' %s | FileCheck %s

piko.record @P {"points" : f32[4 : 4] at 0, "index" : i32 at 16} size 20 align 4
piko.record @V {"z" : f32 at 0} size 4 align 4

// Loops that read a primitive's array again and again: its elements are gathered
// once, into rows with a number for each lane.
// CHECK-LABEL: piko.pipeline @Again
// CHECK:         %[[ROWS:.*]] = memref.alloca() {alignment = 64 : i64} : memref<64xf32>
// CHECK-COUNT-4: piko.cpu.get %{{.*}} "points"[%{{.*}}] of @P
// CHECK:         scf.for
// CHECK:           scf.for
// CHECK-NOT:         piko.cpu.get
// CHECK:             vector.load %[[ROWS]]
// CHECK:         piko.cpu.scatter
piko.pipeline @Again rank 1 {
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c4 = arith.constant 4 : index
    %c9 = arith.constant 9 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %n = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %index = piko.get %p "index" : !piko.prim<@P> -> i32
        %sum = scf.for %y = %c0 to %c9 step %c1 iter_args(%s = %zero) -> f32 {
          %row = scf.for %x = %c0 to %c4 step %c1 iter_args(%t = %s) -> f32 {
            %v = piko.get %p "points"[%x] : !piko.prim<@P> -> f32
            %square = arith.mulf %v, %t : f32
            %next = arith.addf %square, %v : f32
            scf.yield %next : f32
          }
          scf.yield %row : f32
        }
        piko.store %sum, checked @out[%index : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// Each element is read once: gathers stay where they are.
// CHECK-LABEL: piko.pipeline @Once
// CHECK:         scf.for
// CHECK:           scf.for
// CHECK:             piko.cpu.get %{{.*}} "points"[%{{.*}}] of @P
piko.pipeline @Once rank 1 {
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c4 = arith.constant 4 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %n = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %index = piko.get %p "index" : !piko.prim<@P> -> i32
        %sum = scf.for %x = %c0 to %c4 step %c1 iter_args(%t = %zero) -> f32 {
          %v = piko.get %p "points"[%x] : !piko.prim<@P> -> f32
          %square = arith.mulf %v, %t : f32
          %next = arith.addf %square, %v : f32
          scf.yield %next : f32
        }
        piko.store %sum, checked @out[%index : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
