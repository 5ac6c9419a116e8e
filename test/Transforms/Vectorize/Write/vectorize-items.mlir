// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @F {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"y" : f32 at 0} size 4 align 4

// Primitives as lanes: their fields are read by address, what is emitted on two
// sides of a condition follows after, in the order of lanes, and a writer that
// counts goes through all of them.
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         scf.for %[[I:.*]] = %{{.*}} to %{{.*}} step %c16 {
// CHECK:           %[[LEFT:.*]] = arith.cmpi sgt, %{{.*}} : vector<16xi32>
// CHECK:           %[[AS:.*]] = piko.cpu.items %[[BINS:.*]][%[[I]] : index] mask %[[LEFT]]
// CHECK:           %[[Z:.*]] = piko.cpu.get %[[AS]] "z" of @F mask %[[LEFT]]
// CHECK-NOT:       piko.storage.append
// CHECK:           %[[OLT:.*]] = arith.cmpf olt, %[[Z]]
// CHECK:           %[[YES:.*]] = arith.select %[[LEFT]], %[[OLT]]
// CHECK:           scf.if
// CHECK:             %[[ROOT:.*]] = math.sqrt %[[Z]] : vector<16xf32>
// CHECK:             vector.store %[[ROOT]], %[[SLOT:.*]][%c0]
// CHECK:             vector.bitcast %[[YES]] : vector<16xi1> to vector<1xi16>
// CHECK:           scf.if
// CHECK:             math.floor
// CHECK:           piko.cpu.is_counted
// CHECK:           scf.while
// CHECK:             math.cttz
// CHECK:             scf.if
// CHECK:               %[[ONE:.*]] = memref.load %[[SLOT]]
// CHECK:               piko.storage.append %{{.*}}[0] (%[[ONE]])
// CHECK:             scf.if
// CHECK:               piko.storage.append
// CHECK:             scf.if
// CHECK:               piko.storage.next
piko.pipeline @Emits rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [0] threads 1 : @G -> [] {}
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
        %0 = arith.mulf %z, %z : f32
        %1 = arith.addf %0, %z : f32
        %2 = arith.mulf %1, %z : f32
        %3 = arith.mulf %2, %2 : f32
        %4 = arith.mulf %3, %1 : f32
        %5 = arith.divf %4, %0 : f32
        %less = arith.cmpf olt, %z, %half : f32
        scf.if %less {
          %root = math.sqrt %z : f32
          %p = piko.storage.append %writer[0] (%root) : f32 -> !piko.prim<@G>
        } else {
          %6 = math.floor %5 : f32
          %7 = arith.mulf %6, %z : f32
          %p = piko.storage.append %writer[0] (%7) : f32 -> !piko.prim<@G>
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
piko.record @D {"z" : f32 at 0} size 4 align 4

// Two images keep their order one after the other: all lanes update the first,
// vectors compute for those that passed, and all of these update the second.
// CHECK-LABEL: piko.pipeline @Updates
// CHECK:         piko.cpu.items
// CHECK:         scf.while
// CHECK:           piko.load checked @depth
// CHECK:           piko.store %{{.*}}, checked @depth
// CHECK:         %[[PASSED:.*]] = arith.select %{{.*}} : vector<16xi1>, vector<16xi1>
// CHECK:         math.sqrt %{{.*}} : vector<16xf32>
// CHECK:         scf.while
// CHECK-NOT:       @depth
// CHECK:           piko.store %{{.*}}, checked @color
piko.pipeline @Updates rank 1 {
  piko.image @depth : @D rank 1
  piko.image @color : @D rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = piko.get %f "k" : !piko.prim<@F> -> i32
        %old = piko.load checked @depth[%k : i32] "z" : f32
        %nearer = arith.cmpf olt, %z, %old : f32
        %new = arith.select %nearer, %z, %old : f32
        piko.store %new, checked @depth[%k : i32] "z" : f32
        scf.if %nearer {
          %0 = math.sqrt %z : f32
          %1 = arith.divf %z, %0 : f32
          %2 = math.sqrt %1 : f32
          %3 = arith.divf %2, %0 : f32
          piko.store %3, checked @color[%k : i32] "z" : f32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4

// Which primitive may differ between lanes: a choice is one of addresses.
// CHECK-LABEL: piko.pipeline @Chooses
// CHECK:         %[[ONE:.*]] = piko.cpu.items
// CHECK:         %[[OTHER:.*]] = piko.cpu.items %{{.*}}[%{{.*}} : vector<16xindex>]
// CHECK:         %[[AS:.*]] = arith.select %{{.*}}, %{{.*}}, %[[ONE]] : vector<16xi1>, vector<16xindex>
// CHECK:         piko.cpu.get %[[AS]] "z" of @F
piko.pipeline @Chooses rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %c3 = arith.constant 3 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %less = arith.cmpf olt, %z, %half : f32
        %chosen = scf.if %less -> (!piko.prim<@F>) {
          %j = arith.andi %i, %c3 : index
          %g = piko.storage.item %bins[%j] : !piko.bins<@F> -> !piko.prim<@F>
          scf.yield %g : !piko.prim<@F>
        } else {
          scf.yield %f : !piko.prim<@F>
        }
        %y = piko.get %chosen "z" : !piko.prim<@F> -> f32
        %0 = math.sqrt %y : f32
        %1 = arith.divf %y, %0 : f32
        %2 = arith.divf %1, %z : f32
        piko.store %2, checked @out[%i : index] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4

piko.pipeline @Stays rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is not vectorized: each lane would have a copy of this array, which is large}}
      scf.for %i = %lo to %hi step %c1 {
        // expected-note@+1 {{here}}
        %large = memref.alloca() : memref<5000xf32>
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        memref.store %z, %large[%c1] : memref<5000xf32>
        %v = memref.load %large[%i] : memref<5000xf32>
        piko.store %v, checked @out[%i : index] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      // expected-remark-re@+1 {{stage 'a': process is not vectorized: 16 at once are expected to take {{[0-9]+}} cycles, and one after the other {{[0-9]+}}; specifyLanes(Items) does so all the same}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        // expected-note@+1 {{lanes access elements in different places}}
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = arith.fptoui %z : f32 to i32
        // expected-note@+1 {{lanes take turns to access 'out'}}
        piko.atomic add checked @out[%k : i32] "n", %k : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
