// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @F {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4

// Two records of each lane, one under a condition, and a bin for each: where
// positions are not counted, and lanes are many, vectors emit both.
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         %[[W:.*]] = piko.cpu.open_writer
// CHECK:         math.ctpop
// CHECK:         %[[FEW:.*]] = arith.cmpi ule
// CHECK:         %[[COUNTED:.*]] = piko.cpu.is_counted %[[W]]
// CHECK:         %[[TURNS:.*]] = arith.ori %[[FEW]], %[[COUNTED]]
// CHECK:         scf.if %[[TURNS]] {
// CHECK:           scf.while
// CHECK:             piko.storage.append %[[W]][0]
// CHECK:             piko.storage.append_bin %[[W]][0]
// CHECK:             piko.storage.append %[[W]][0]
// CHECK:         } else {
// CHECK-NOT:       scf.while
// CHECK:           piko.cpu.append %[[W]][0] (%{{.*}}, %{{.*}}, %{{.*}}, %{{.*}} : {{.*}}) of @G mask %{{.*}}, %{{.*}} : vector<16xi1>, vector<16xi1> in @b[%{{.*}}, %{{.*}} : vector<16xindex>, vector<16xindex>]
// CHECK-NOT:       scf.while
piko.pipeline @Emits rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = piko.get %f "k" : !piko.prim<@F> -> i32
        %0 = arith.mulf %z, %z : f32
        %1 = math.sqrt %0 : f32
        %2 = arith.divf %1, %z : f32
        %3 = math.sqrt %2 : f32
        %4 = arith.divf %3, %1 : f32
        %less = arith.cmpf olt, %4, %half : f32
        %at = arith.index_cast %k : i32 to index
        scf.if %less {
          %p = piko.storage.append %writer[0] (%4, %k) : f32, i32 -> !piko.prim<@G>
          piko.storage.append_bin %writer[0] of @b in %at
        }
        %q = piko.storage.append %writer[0] (%2, %k) : f32, i32 -> !piko.prim<@G>
        piko.storage.append_bin %writer[0] of @b in %c1
        piko.storage.next %writer
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4, "u" : f32 at 8, "v" : f32 at 12} size 16 align 4

// A record may go to several bins: lanes take turns, and copy what vectors have
// stored.
// CHECK-LABEL: piko.pipeline @Boxes
// CHECK:         %[[W:.*]] = piko.cpu.open_writer
// CHECK-NOT:     piko.cpu.append %
// CHECK:         piko.cpu.store_records %[[MEMORY:.*]](%{{.*}}, %{{.*}}, %{{.*}}, %{{.*}} :
// CHECK:         scf.while
// CHECK:           %[[LANE:.*]] = arith.index_castui
// CHECK:           piko.cpu.append_record %[[W]][0] from %[[MEMORY]][%[[LANE]] of 16]
// CHECK:           scf.for
// CHECK:             piko.storage.append_bin
piko.pipeline @Boxes rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = piko.get %f "k" : !piko.prim<@F> -> i32
        %0 = arith.mulf %z, %z : f32
        %1 = math.sqrt %0 : f32
        %2 = arith.divf %1, %z : f32
        %3 = math.sqrt %2 : f32
        %4 = arith.divf %3, %1 : f32
        %less = arith.cmpf olt, %4, %half : f32
        %at = arith.index_cast %k : i32 to index
        // expected-note@+1 {{lanes take turns to emit, in order: a primitive may go to several bins}}
        %p = piko.storage.append %writer[0] (%4, %k, %2, %3) : f32, i32, f32, f32 -> !piko.prim<@G>
        scf.for %bin = %c1 to %at step %c1 {
          piko.storage.append_bin %writer[0] of @b in %bin
        }
        piko.storage.next %writer
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"y" : i16 at 0, "u" : i16 at 2, "v" : i16 at 4} size 6 align 2

// No whole words: lanes take turns.
// CHECK-LABEL: piko.pipeline @Halves
// CHECK-NOT:     piko.cpu.append %
// CHECK-NOT:     piko.cpu.store_records
// CHECK:         scf.while
// CHECK:           piko.storage.append
piko.pipeline @Halves rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = piko.get %f "k" : !piko.prim<@F> -> i32
        %0 = arith.mulf %z, %z : f32
        %1 = math.sqrt %0 : f32
        %2 = arith.divf %1, %z : f32
        %3 = math.sqrt %2 : f32
        %4 = arith.divf %3, %1 : f32
        %less = arith.cmpf olt, %4, %half : f32
        %s = arith.trunci %k : i32 to i16
        // expected-note@+1 {{lanes take turns to emit, in order: the record is no whole number of words of 4 bytes, up to 256 bytes}}
        %p = piko.storage.append %writer[0] (%s, %s, %s) : i16, i16, i16 -> !piko.prim<@G>
        piko.storage.next %writer
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
