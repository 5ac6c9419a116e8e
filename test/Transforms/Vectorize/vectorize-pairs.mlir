// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @B {"w" : i32 at 0, "h" : i32 at 4, "z" : f32 at 8} size 12 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// The cells of boxes, which loops in plain C++ go through: vectors are filled
// with pairs of a box and a cell. A scan over the boxes' cells tells where each
// begins, a binary search which box a pair is of. Boxes that are too large run in
// step.
// CHECK-LABEL: piko.pipeline @Boxes
// CHECK:         %[[W:.*]] = piko.cpu.get %{{.*}} "w" of @B
// CHECK:         scf.if %{{.*}} {
// CHECK:           scf.while
// CHECK:             scf.while
// CHECK:         } else {
// CHECK:           %[[CELLS:.*]] = arith.muli %{{.*}}, %{{.*}} : vector<16xi32>
// CHECK:           vector.shuffle %[[CELLS]], %{{.*}} [16, 0, 1, 2,
// CHECK:           vector.shuffle %{{.*}} [16, 16, 0, 1,
// CHECK:           vector.shuffle %{{.*}} [16, 16, 16, 16, 0,
// CHECK:           vector.shuffle %{{.*}} [16, 16, 16, 16, 16, 16, 16, 16, 0,
// CHECK:           %[[TOTAL:.*]] = vector.extract %[[ENDS:.*]][15] : i32 from vector<16xi32>
// CHECK:           %[[PART:.*]] = arith.divf
// CHECK:           %[[STOP:.*]] = arith.index_cast %[[TOTAL]] : i32 to index
// CHECK:           scf.for %[[K:.*]] = %c0 to %[[STOP]] step %c16 {
// CHECK-COUNT-4:     piko.cpu.permute %[[ENDS]][%{{.*}}] : vector<16xi32>, vector<16xi32>
// CHECK:             %[[HERE:.*]] = piko.cpu.permute %[[PART]]
// CHECK:             %[[ROW:.*]] = arith.mulf %{{.*}}, %[[HERE]]
// CHECK:             arith.fptosi %[[ROW]] : vector<16xf32> to vector<16xi32>
// CHECK:             piko.atomic add checked @sums
// CHECK-NOT:         scf.while {{.*}} : (vector<16xindex>
piko.pipeline @Boxes rank 1 {
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
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@B>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %b = piko.storage.item %bins[%i] : !piko.bins<@B> -> !piko.prim<@B>
        %w = piko.get %b "w" : !piko.prim<@B> -> i32
        %h = piko.get %b "h" : !piko.prim<@B> -> i32
        %rows = scf.while (%y = %c0) : (i32) -> i32 {
          %more = arith.cmpi sle, %y, %h : i32
          scf.condition(%more) %y : i32
        } do {
        ^bb0(%y: i32):
          %columns = scf.while (%x = %c0) : (i32) -> i32 {
            %more = arith.cmpi slt, %x, %w : i32
            scf.condition(%more) %x : i32
          } do {
          ^bb0(%x: i32):
            %sum = arith.addi %x, %y : i32
            // expected-note@+1 {{lanes take turns to access 'sums'}}
            piko.atomic add checked @sums[%sum : i32] "n", %w : i32
            %next = arith.addi %x, %c1 : i32
            scf.yield %next : i32
          }
          %next = arith.addi %y, %c1 : i32
          scf.yield %next : i32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@B>
  }
}

// -----

piko.record @B {"w" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @N {"n" : f32 at 0} size 4 align 4

// A sum that goes from iteration to iteration, and stores, of which the last one stays,
// keep a lane's iterations in order: all lanes run in step.
// CHECK-LABEL: piko.pipeline @Carried
// CHECK-NOT:     vector.shuffle
// CHECK:         scf.while
// CHECK:         scf.while
piko.pipeline @Carried rank 1 {
  piko.buffer @out : @N
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
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@B>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %b = piko.storage.item %bins[%i] : !piko.bins<@B> -> !piko.prim<@B>
        %w = piko.get %b "w" : !piko.prim<@B> -> i32
        %z = piko.get %b "z" : !piko.prim<@B> -> f32
        %sums:2 = scf.while (%x = %c0, %s = %z) : (i32, f32) -> (i32, f32) {
          %more = arith.cmpi slt, %x, %w : i32
          scf.condition(%more) %x, %s : i32, f32
        } do {
        ^bb0(%x: i32, %s: f32):
          %t = arith.mulf %s, %z : f32
          %next = arith.addi %x, %c1 : i32
          scf.yield %next, %t : i32, f32
        }
        %stores = scf.while (%x = %c0) : (i32) -> i32 {
          %more = arith.cmpi slt, %x, %w : i32
          scf.condition(%more) %x : i32
        } do {
        ^bb0(%x: i32):
          // expected-note@+1 {{lanes write 'out' in different places, by a scatter}}
          piko.store %sums#1, checked @out[%w : i32] "n" : f32
          %next = arith.addi %x, %c1 : i32
          scf.yield %next : i32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@B>
  }
}
