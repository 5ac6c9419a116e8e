// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=16},piko-vectorize),canonicalize,cse)' %s 2>/dev/null | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8},piko-vectorize),canonicalize,cse)' %s 2>/dev/null | FileCheck %s --check-prefix=TURNS

piko.record @B {"w" : i32 at 0, "v" : i32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// What pairs of a primitive and an iteration change in a private copy is compressed into
// lists; a scalar loop goes through these when they are full, and after the loop
// over primitives. A value that all lanes share, but not all primitives, is in a
// list, too. With fewer lanes there is no such instruction, and lanes take turns.
// CHECK-LABEL: piko.pipeline @Listed
// CHECK:         %[[COPY:.*]] = piko.cpu.private_copy add @sums
// CHECK-DAG:     %[[COUNT:.*]] = memref.alloca() {alignment = 64 : i64} : memref<1xindex>
// CHECK-DAG:     %[[PLACES:.*]] = memref.alloca() {alignment = 64 : i64} : memref<272xi32>
// CHECK-DAG:     %[[VALUES:.*]] = memref.alloca() {alignment = 64 : i64} : memref<272xi32>
// CHECK:         memref.store %c0, %[[COUNT]]
// CHECK:         scf.for {{.*}} step %c16
// CHECK:           scf.for {{.*}} step %c16
// CHECK:             scf.if
// CHECK:               %[[BEFORE:.*]] = memref.load %[[COUNT]]
// CHECK:               vector.compressstore %[[PLACES]][%[[BEFORE]]], %[[MASK:.*]], %
// CHECK:               vector.compressstore %[[VALUES]][%[[BEFORE]]], %[[MASK]], %
// CHECK:               %[[MORE:.*]] = math.ctpop %{{.*}} : i16
// CHECK:               %[[AFTER:.*]] = arith.addi %[[BEFORE]], %
// CHECK:               memref.store %[[AFTER]], %[[COUNT]]
// CHECK:               %[[FULL:.*]] = arith.cmpi uge, %[[AFTER]], %c256
// CHECK:               scf.if %[[FULL]] {
// CHECK-NEXT:            scf.for %[[I:.*]] = %c0 to %[[AFTER]] step %c1 {
// CHECK:                   %[[PLACE:.*]] = memref.load %{{.*}}[%[[I]]]
// CHECK:                   %[[VALUE:.*]] = memref.load %{{.*}}[%[[I]]]
// CHECK:                   piko.atomic add checked @sums[%[[PLACE]] : i32] "n", %[[VALUE]] in %[[COPY]]
// CHECK:                 memref.store %c0, %[[COUNT]]
// CHECK:         %[[LEFT:.*]] = memref.load %[[COUNT]]
// CHECK:         scf.for %{{.*}} = %c0 to %[[LEFT]] step %c1 {
// CHECK:           piko.atomic add checked @sums
// CHECK:         piko.cpu.close_writer
// TURNS-LABEL: piko.pipeline @Listed
// TURNS-NOT:     compressstore
// TURNS:         math.cttz
// TURNS:         piko.atomic add checked @sums
piko.pipeline @Listed rank 1 {
  piko.buffer @sums : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @B -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@B>
    %n = piko.storage.unit_count %bins : !piko.bins<@B>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@B>
      %copy = piko.cpu.private_copy add @sums "n" of %writer often
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@B>
      scf.for %i = %lo to %hi step %step {
        %b = piko.storage.item %bins[%i] : !piko.bins<@B> -> !piko.prim<@B>
        %w = piko.get %b "w" : !piko.prim<@B> -> i32
        %v = piko.get %b "v" : !piko.prim<@B> -> i32
        %columns = scf.while (%x = %c0) : (i32) -> i32 {
          %more = arith.cmpi slt, %x, %w : i32
          scf.condition(%more) %x : i32
        } do {
        ^bb0(%x: i32):
          %even = arith.andi %x, %c1 : i32
          %is_odd = arith.cmpi eq, %even, %c1 : i32
          scf.if %is_odd {
            piko.atomic add checked @sums[%x : i32] "n", %v in %copy : i32
          }
          %next = arith.addi %x, %c1 : i32
          scf.yield %next : i32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@B>
  }

  // Without a private copy, others change the state, too.
  // CHECK:       piko.kernel @locked
  // CHECK-NOT:     compressstore
  // CHECK:         piko.storage.close_bins
  piko.source @l
  piko.stage @l bins [0] threads 1 : @B -> [] {
    piko.schedule load_balance lanes items
  }
  piko.kernel @locked {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @l : !piko.bins<@B>
    %n = piko.storage.unit_count %bins : !piko.bins<@B>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@B>
      scf.for %i = %lo to %hi step %step {
        %b = piko.storage.item %bins[%i] : !piko.bins<@B> -> !piko.prim<@B>
        %w = piko.get %b "w" : !piko.prim<@B> -> i32
        %columns = scf.while (%x = %c0) : (i32) -> i32 {
          %more = arith.cmpi slt, %x, %w : i32
          scf.condition(%more) %x : i32
        } do {
        ^bb0(%x: i32):
          piko.atomic add checked @sums[%x : i32] "n", %w : i32
          %next = arith.addi %x, %c1 : i32
          scf.yield %next : i32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@B>
  }
}
