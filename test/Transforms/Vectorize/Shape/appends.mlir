// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefix=VECTORS

// Iterations that append to a list push, each under its condition, to a count in
// memory, and lanes do so by stream compaction. The list is padded: nothing else
// fills it. A short loop appends as it did.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Appends
// CHECK:         %[[LIST:.*]] = memref.alloca() : memref<1016xi32>
// CHECK:         %[[COUNT:.*]] = memref.alloca() : memref<1xi32>
// CHECK:         memref.store %c0_i32, %[[COUNT]][%c0]
// CHECK:         scf.for %[[I:.*]] = %c0 to %c1000 step %c1 {
// CHECK:           scf.if
// CHECK:             piko.storage.push(%{{.*}} : i32) to(%[[LIST]] : memref<1016xi32>) count %[[COUNT]] padded : memref<1xi32>
// CHECK:         } {piko.vector_lanes = 16 : i64}
// CHECK:         %[[N:.*]] = memref.load %[[COUNT]][%c0]
// CHECK:         arith.sitofp %[[N]] : i32 to f32
// VECTORS-LABEL: piko.pipeline @Appends
// VECTORS:         %[[LIST:.*]] = memref.alloca() : memref<1016xi32>
// VECTORS:         %[[COUNT:.*]] = memref.alloca() : memref<1xi32>
// VECTORS:         %[[N:.*]] = memref.load %[[COUNT]]
// VECTORS:         %[[MORE:.*]] = math.ctpop
// VECTORS:         %[[FRONT:.*]] = piko.cpu.compress %{{.*}} mask %{{.*}} : vector<16xi32>, vector<16xi1>
// VECTORS:         vector.store %[[FRONT]], %[[LIST]]
// VECTORS:         %[[SUM:.*]] = arith.addi %[[N]], %{{.*}} : i32
// VECTORS:         memref.store %[[SUM]], %[[COUNT]]
piko.pipeline @Appends rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : i32
    %end = arith.constant 1000 : i32
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %list = memref.alloca() : memref<1000xi32>
      // expected-remark@+1 {{iterations of this loop append in order, by stream compaction, and are vectorized for 16 at once}}
      %r:2 = scf.while (%i = %zero, %k = %zero) : (i32, i32) -> (i32, i32) {
        %goes = arith.cmpi slt, %i, %end : i32
        scf.condition(%goes) %i, %k : i32, i32
      } do {
      ^bb0(%i: i32, %k: i32):
        %x = arith.index_cast %i : i32 to index
        %v = piko.load checked @in[%x : index] "z" : f32
        %w = arith.mulf %v, %v : f32
        %is_in = arith.cmpf olt, %w, %two : f32
        %l = scf.if %is_in -> i32 {
          %j = arith.index_cast %k : i32 to index
          memref.store %i, %list[%j] : memref<1000xi32>
          %more = arith.addi %k, %one : i32
          scf.yield %more : i32
        } else {
          scf.yield %k : i32
        }
        %next = arith.addi %i, %one : i32
        scf.yield %next, %l : i32, i32
      }
      %f = arith.sitofp %r#1 : i32 to f32
      piko.store %f, checked @out[%u : index] "z" : f32
      %first = memref.load %list[%u] : memref<1000xi32>
      %g = arith.sitofp %first : i32 to f32
      piko.store %g, checked @out[%n : index] "z" : f32
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

// Where a list is full, no more is pushed: what comes before that test is done in
// vain. The list is filled before, and what stands behind its end stays there.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Limited
// CHECK:         %[[LIST:.*]] = memref.alloca() : memref<64xf32>
// CHECK:         piko.storage.push(%{{.*}} : f32) to(%[[LIST]] : memref<64xf32>) count %{{.*}} below %c64_i32 : memref<1xi32>, i32
// VECTORS-LABEL: piko.pipeline @Limited
// VECTORS:         arith.minui %{{.*}}, %{{.*}} : i64
// VECTORS:         vector.maskedstore
piko.pipeline @Limited rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : i32
    %most = arith.constant 64 : i32
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %list = memref.alloca() : memref<64xf32>
      memref.store %two, %list[%c0] : memref<64xf32>
      // expected-remark@+1 {{append in order, by stream compaction}}
      %l = scf.for %x = %c0 to %n step %c1 iter_args(%k = %zero) -> i32 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %w = arith.mulf %v, %v : f32
        %is_in = arith.cmpf olt, %w, %two : f32
        %has_room = arith.cmpi slt, %k, %most : i32
        %both = arith.andi %is_in, %has_room : i1
        %j = arith.index_cast %k : i32 to index
        %more = scf.if %both -> i32 {
          memref.store %w, %list[%j] : memref<64xf32>
          %sum = arith.addi %k, %one : i32
          scf.yield %sum : i32
        } else {
          scf.yield %k : i32
        }
        scf.yield %more : i32
      }
      %j = arith.index_cast %l : i32 to index
      %last = memref.load %list[%j] : memref<64xf32>
      piko.store %last, checked @out[%u : index] "z" : f32
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

// An iteration that reads the list depends on those before it.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Refused
// CHECK-NOT:     piko.storage.push
piko.pipeline @Refused rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %list = memref.alloca() : memref<64xf32>
      // expected-remark@+1 {{this loop appends one element after the other}}
      %l = scf.for %x = %c0 to %n step %c1 iter_args(%k = %c0) -> index {
        %v = piko.load checked @in[%x : index] "z" : f32
        // expected-note@+1 {{here a list, or its length, is used for something else}}
        %old = memref.load %list[%c0] : memref<64xf32>
        %w = arith.mulf %v, %old : f32
        %is_in = arith.cmpf olt, %w, %two : f32
        %more = scf.if %is_in -> index {
          memref.store %w, %list[%k] : memref<64xf32>
          %sum = arith.addi %k, %c1 : index
          scf.yield %sum : index
        } else {
          scf.yield %k : index
        }
        scf.yield %more : index
      }
      %last = memref.load %list[%l] : memref<64xf32>
      piko.store %last, checked @out[%u : index] "z" : f32
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
