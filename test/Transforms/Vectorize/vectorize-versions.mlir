// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{window=2},piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{window=1000},piko-vectorize),canonicalize,cse)' --split-input-file %s 2>/dev/null | FileCheck %s --check-prefix=WIDE
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{window=2 sensitivities=true},piko-vectorize))' --split-input-file -o %t.mlir %s 2>/dev/null | FileCheck %s --check-prefix=NUMBERS

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// Estimates are within a factor of two of each other: both versions are held, and
// the unit's writer says which runs.
// NUMBERS: {"kernel":"near","number":0,"loop":"a, process of primitives, {{.*}}","expected":false,"vectors":{{[0-9.]+}},"scalar":{{[0-9.]+}},"by":{"scalar":[0,{{[0-9.]+}}]{{.*}}"gather":[{{[0-9.]+}},0]
// CHECK-LABEL: piko.kernel @near
// CHECK:         %[[W:.*]] = piko.cpu.open_writer
// CHECK:         %[[TAKES:.*]] = piko.cpu.takes_vectors %[[W]] {loop = "a, process of primitives, vectorize-versions.mlir:{{[0-9]+}}:{{[0-9]+}}", number = 0 : i64, scalar = {{[0-9]+}} : i64, vectors = {{[0-9]+}} : i64}
// CHECK:         scf.if %[[TAKES]] {
// CHECK:           vector<32x
// CHECK:         } else {
// CHECK-NOT:       vector<
// CHECK:           piko.store
// CHECK:         piko.cpu.close_writer
piko.pipeline @Near rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @near {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@Row>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once, and held one after the other as well, to measure which is faster: }}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %sum = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %none) -> f32 {
          %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
          %0 = arith.mulf %z, %s : f32
          %1 = arith.addf %0, %z : f32
          %2 = arith.mulf %1, %1 : f32
          %3 = arith.addf %2, %z : f32
          scf.yield %3 : f32
        }
        piko.store %sum, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// What the schedule specifies is not measured.
// CHECK-LABEL: piko.kernel @specified
// CHECK-NOT:     takes_vectors
// WIDE-LABEL:  piko.kernel @specified
// WIDE-NOT:      takes_vectors
piko.pipeline @Specified rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @specified {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@Row>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %sum = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %none) -> f32 {
          %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
          %0 = arith.mulf %z, %s : f32
          %1 = arith.addf %0, %z : f32
          %2 = arith.mulf %1, %1 : f32
          %3 = arith.addf %2, %z : f32
          scf.yield %3 : f32
        }
        piko.store %sum, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @D {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4

// Where vectors surely take more, nothing is measured, unless a wide window says
// so; of the scalar version the inner loop is a candidate of its own.
// CHECK-LABEL: piko.kernel @far
// CHECK-NOT:     takes_vectors
// WIDE-LABEL:  piko.kernel @far
// WIDE-DAG:      %[[OUTER:.*]] = piko.cpu.takes_vectors %{{.*}} {loop = "a, process of primitives, {{.*}}", number = 0 : i64
// WIDE-DAG:      %[[INNER:.*]] = piko.cpu.takes_vectors %{{.*}} {expected, loop = "a, iterations, {{.*}}", number = 1 : i64, {{.*}}within = 0 : i64}
// WIDE:          scf.if %[[OUTER]] {
// WIDE:          } else {
// WIDE:            scf.if %[[INNER]] {
piko.pipeline @Far rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @D -> [] {}
  piko.kernel @far {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@D>
    %n = piko.storage.unit_count %bins : !piko.bins<@D>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@D>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@D>
      // expected-remark@+1 {{stage 'a': process is not vectorized: 16 at once are expected to take}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@D> -> !piko.prim<@D>
        %z = piko.get %f "z" : !piko.prim<@D> -> f32
        %k = piko.get %f "k" : !piko.prim<@D> -> i32
        %at = arith.index_cast %k : i32 to index
        scf.for %x = %c0 to %c32 step %c1 {
          %j = arith.addi %at, %x : index
          %0 = arith.mulf %z, %z : f32
          %y = arith.index_cast %x : index to i32
          %v = arith.sitofp %y : i32 to f32
          %1 = arith.mulf %0, %v : f32
          %2 = arith.divf %1, %z : f32
          %3 = math.sqrt %2 : f32
          %4 = arith.divf %3, %1 : f32
          // expected-note@+1 {{lanes access elements in different places}}
          piko.store %4, checked @out[%j : index] "z" : f32
        } {piko.lanes}
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@D>
  }
}
