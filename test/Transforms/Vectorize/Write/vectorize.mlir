// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @V {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4

// A row of pixels: masked access to the pixels, a branch around what no lane
// does, and few pixels as they were. What all share stays scalar.
// CHECK-LABEL: piko.pipeline @Row
// CHECK:         %[[COUNT:.*]] = arith.subi %[[HI:.*]], %[[LO:.*]] : index
// CHECK:         %[[LONG:.*]] = arith.cmpi sge, %[[COUNT]], %c4
// CHECK:         scf.if %[[LONG]] {
// CHECK:           scf.for %[[X:.*]] = %[[LO]] to %[[HI]] step %c16 {
// CHECK:             %[[AT:.*]] = arith.addi %{{.*}}, %{{.*}} : vector<16xindex>
// CHECK:             %[[MASK:.*]] = arith.cmpi sgt, %{{.*}} : vector<16xi32>
// CHECK:             %[[SHARED:.*]] = piko.load checked @v[%c3 : index] "y" : f32
// CHECK:             %[[Z:.*]] = arith.mulf %{{.*}} : vector<16xf32>
// CHECK:             %[[OLD:.*]] = piko.cpu.gather consecutive @depth[%[[X]], %c3 : index, index] "z" mask %[[MASK]] : vector<16xi1>, vector<16xf32>
// CHECK:             %[[NEARER:.*]] = arith.cmpf olt, %{{.*}}, %[[OLD]]
// CHECK:             %[[BOTH:.*]] = arith.select %[[MASK]], %[[NEARER]], %{{.*}}
// CHECK:             %[[ANY:.*]] = vector.reduction <or>, %[[BOTH]]
// CHECK:             scf.if %[[ANY]] {
// CHECK:               piko.cpu.scatter %{{.*}}, consecutive @depth[%[[X]], %c3 : index, index] "z" mask %[[BOTH]]
// CHECK:         } else {
// CHECK:           scf.for %{{.*}} = %[[LO]] to %[[HI]] step %c1 {
// CHECK:             piko.store %{{.*}}, checked @depth
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
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
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

// A loop goes on as long as some lane does; those that have ended keep what they
// have. An array has a column for each lane.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Loop
// CHECK:         %[[COLUMNS:.*]] = memref.alloca() {alignment = 64 : i64} : memref<64xf32>
// CHECK:         scf.while (%{{.*}} = %{{.*}}, %{{.*}} = %{{.*}}, %[[M:.*]] = %{{.*}}) : (vector<16xf32>, vector<16xf32>, vector<16xi1>)
// CHECK:           %[[GOES:.*]] = arith.cmpf olt, %{{.*}} : vector<16xf32>
// CHECK:           %[[LEFT:.*]] = arith.select %[[M]], %{{.*}}, %{{.*}} : vector<16xi1>, vector<16xf32>
// CHECK:           %[[GOING:.*]] = arith.select %[[M]], %[[GOES]], %{{.*}} : vector<16xi1>
// CHECK:           %[[SOME:.*]] = vector.reduction <or>, %[[GOING]]
// CHECK:           scf.condition(%[[SOME]]) %[[LEFT]], %[[GOING]]
// CHECK:           %[[OLD:.*]] = vector.load %[[COLUMNS]][%c32]
// CHECK:           %[[NEW:.*]] = arith.select %{{.*}}, %{{.*}}, %[[OLD]] : vector<16xi1>
// CHECK:           vector.store %[[NEW]], %[[COLUMNS]][%c32]
// CHECK-NOT:     vector.gather
piko.pipeline @Loop rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %c2 = arith.constant 2 : index
    %c3 = arith.constant 3 : index
    %two = arith.constant 2.0 : f32
    %most = arith.constant 90.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
      scf.for %x = %c1 to %n step %c1 {
        %array = memref.alloca() : memref<4xf32>
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %end = scf.while (%v = %f) : (f32) -> f32 {
          %goes = arith.cmpf olt, %v, %most : f32
          scf.condition(%goes) %v : f32
        } do {
        ^bb0(%v: f32):
          memref.store %v, %array[%c2] : memref<4xf32>
          %next = arith.mulf %v, %two : f32
          scf.yield %next : f32
        }
        %place = arith.andi %x, %c3 : index
        %kept = memref.load %array[%place] : memref<4xf32>
        %sum = arith.addf %kept, %end : f32
        piko.store %sum, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// Emissions run lane by lane, from the first to the last, in order; what they
// need is computed ahead in vectors.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         scf.for %{{.*}} step %c16
// CHECK:           arith.mulf %{{.*}} : vector<16xf32>
// CHECK:           math.sqrt %{{.*}} : vector<16xf32>
// CHECK:           %[[WORD:.*]] = vector.bitcast %{{.*}} : vector<16xi1> to vector<1xi16>
// CHECK:           scf.while
// CHECK:             %[[LANE:.*]] = math.cttz
// CHECK:             piko.storage.append
// CHECK-NOT:         math.sqrt
// CHECK:             piko.storage.append
piko.pipeline @Emits rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
      scf.for %x = %c1 to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %1 = arith.mulf %f, %f : f32
        %2 = arith.addf %1, %f : f32
        %3 = arith.mulf %2, %f : f32
        %4 = arith.addf %3, %f : f32
        %5 = arith.mulf %4, %f : f32
        %6 = arith.addf %5, %f : f32
        %7 = arith.mulf %6, %f : f32
        %8 = arith.addf %7, %f : f32
        %p = piko.storage.append %w[0] (%8) : f32 -> !piko.prim<@F>
        %9 = math.sqrt %8 : f32
        %q = piko.storage.append %w[0] (%9) : f32 -> !piko.prim<@F>
      } {piko.lanes}
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// What is not worth it, and what cannot be, says why.
piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Stays
// CHECK-NOT:     vector
// CHECK:         piko.storage.close_bins
piko.pipeline @Stays rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %c0 = arith.constant 0 : index
    %size = arith.constant 64 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-remark-re@+1 {{these iterations are not vectorized: 16 at once are expected to take {{[0-9]+}} cycles, and one after the other {{[0-9]+}}; specifyLanes(Iterations) does so all the same}}
      scf.for %x = %c1 to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %at = arith.shrui %i, %i : i32
        // expected-note@+1 {{lanes take turns to access 'out'}}
        piko.atomic add checked @out[%at : i32] "n", %i : i32
      } {piko.lanes}
      // expected-remark@+1 {{these iterations are not vectorized: each lane would have a copy of this array, which is large}}
      scf.for %x = %c1 to %n step %c1 {
        // expected-note@+1 {{here}}
        %large = memref.alloca() : memref<5000xf32>
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        memref.store %f, %large[%c0] : memref<5000xf32>
        %v = memref.load %large[%x] : memref<5000xf32>
        piko.store %v, checked @out[%x : index] "z" : f32
      } {piko.lanes}
      // What a bin has of a box.
      %box = arith.maxsi %n, %c0 : index
      // expected-remark@+1 {{these iterations are not vectorized: a box may have few pixels; specifyLanes(Iterations) does so all the same}}
      scf.for %x = %box to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %1 = arith.mulf %f, %f : f32
        %2 = arith.addf %1, %f : f32
        %3 = arith.mulf %2, %f : f32
        %4 = arith.addf %3, %f : f32
        piko.store %4, checked @out[%x : index] "z" : f32
      } {piko.lanes}
      // expected-remark@+1 {{these iterations are not vectorized: lanes cannot share this array}}
      scf.for %x = %c1 to %n step %c1 {
        // expected-note@+1 {{here}}
        %bytes = memref.alloca() : memref<64xi8>
        %view = memref.view %bytes[%c0][] : memref<64xi8> to memref<16xf32>
        %v = memref.load %view[%x] : memref<16xf32>
        piko.store %v, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
