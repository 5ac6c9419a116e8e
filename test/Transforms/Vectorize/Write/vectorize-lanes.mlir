// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=8},piko-vectorize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s --check-prefixes=CHECK,EIGHT
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors{lanes=4},piko-vectorize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s --check-prefixes=CHECK,FOUR

piko.record @B {"w" : i32 at 0, "h" : i32 at 4, "z" : f32 at 8} size 12 align 4
piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Rows are cut into as many pixels as a vector has lanes, and fewer pixels than
// vectors pay for stay as they were.
// CHECK-LABEL: piko.pipeline @Row
// CHECK:         arith.cmpi sge, %{{.*}}, %c2
// EIGHT:         scf.for %{{.*}} = %{{.*}} step %c8 {
// FOUR:          scf.for %{{.*}} = %{{.*}} step %c4 {
// EIGHT:           piko.cpu.scatter %{{.*}} : vector<8xi1>, vector<8xf32>
// FOUR:            piko.cpu.scatter %{{.*}} : vector<4xi1>, vector<4xf32>
// CHECK:         } else {
// CHECK:           scf.for %{{.*}} = %{{.*}} step %c1 {
piko.pipeline @Row rank 2 {
  piko.image @depth : @F rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-remark-re@+1 {{these iterations are vectorized for {{4|8}} at once}}
      scf.for %x = %c1 to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %1 = arith.mulf %f, %f : f32
        %2 = arith.addf %1, %f : f32
        %3 = arith.divf %f, %2 : f32
        %4 = arith.divf %3, %1 : f32
        piko.store %4, checked @depth[%x, %c1 : index, index] "z" : f32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// The scan over the cells of boxes has a step for each power of two. With four
// lanes each is asked where it ends; with more, vectors are searched. Lanes that
// take turns are the bits of a byte.
// CHECK-LABEL: piko.pipeline @Boxes
// EIGHT:         vector.shuffle %{{.*}} [8, 0, 1, 2, 3, 4, 5, 6]
// EIGHT:         vector.shuffle %{{.*}} [8, 8, 0, 1, 2, 3, 4, 5]
// EIGHT:         vector.shuffle %{{.*}} [8, 8, 8, 8, 0, 1, 2, 3]
// EIGHT-NOT:     vector.shuffle
// EIGHT:         vector.extract %[[ENDS:.*]][7] : i32 from vector<8xi32>
// EIGHT-COUNT-3: piko.cpu.permute %[[ENDS]][%{{.*}}] : vector<8xi32>, vector<8xi32>
// EIGHT-NOT:     piko.cpu.permute %[[ENDS]]
// EIGHT:         vector.bitcast %{{.*}} : vector<8xi1> to vector<1xi8>
// FOUR:          vector.shuffle %{{.*}} [4, 0, 1, 2]
// FOUR:          vector.shuffle %{{.*}} [4, 4, 0, 1]
// FOUR-NOT:      vector.shuffle
// FOUR:          vector.extract %[[ENDS:.*]][3] : i32 from vector<4xi32>
// FOUR-NOT:      piko.cpu.permute %[[ENDS]]
// FOUR:          vector.extract %[[ENDS]][0]
// FOUR:          vector.extract %[[ENDS]][1]
// FOUR:          vector.extract %[[ENDS]][2]
// FOUR-NOT:      vector.extract
// FOUR:          vector.bitcast %{{.*}} : vector<4xi1> to vector<1xi4>
// FOUR:          arith.extui %{{.*}} : i4 to i8
// CHECK:         piko.atomic add checked @sums
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
      // expected-remark-re@+1 {{stage 'a': process is vectorized for {{4|8}} primitives at once}}
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
