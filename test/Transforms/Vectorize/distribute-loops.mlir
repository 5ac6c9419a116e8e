// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-distribute-loops{lanes=8},canonicalize,cse))' --verify-diagnostics %s | FileCheck %s

piko.record @Box {"x" : f32 at 0, "y" : f32 at 4, "w" : f32 at 8, "h" : f32 at 12, "first" : i32 at 16, "last" : i32 at 20, "flags" : i32 at 24} size 28 align 4
piko.record @Color {"v" : f32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.buffer @color : @Color
  piko.source @a
  piko.stage @a bins [16, 16] threads 64 : @Box -> [] {}

  // What follows from a box is computed for eight of them, and written to tables;
  // of one or none they are as they were. What the loop takes is read before
  // it, under the condition; what the record has is read there as it was. The
  // condition says that there is one beside it, which stays where it is.
  // CHECK-LABEL: piko.kernel @k
  // CHECK:         %[[SEEN:.*]] = memref.alloca() {alignment = 64 : i64} : memref<8xi32>
  // CHECK:         %[[SLOPES:.*]] = memref.alloca() {alignment = 64 : i64} : memref<8xf32>
  // CHECK-NOT:     memref.alloca
  // CHECK:         scf.for %[[LOWER:.*]] = %{{.*}} to %[[END:.*]] step %c8 {
  // CHECK-NEXT:      %[[BEHIND:.*]] = arith.addi %[[LOWER]], %c8 overflow<nsw>
  // CHECK-NEXT:      %[[UPPER:.*]] = arith.minsi %[[BEHIND]], %[[END]]
  // CHECK:           %[[MANY:.*]] = arith.cmpi sge, %{{.*}}, %c2
  // CHECK:           scf.if %[[MANY]] {
  // CHECK:             piko.cpu.items
  // CHECK:             arith.extui {{.*}} : vector<8xi1> to vector<8xi32>
  // CHECK:             vector.store %{{.*}}, %[[SEEN]][%{{.*}}]
  // CHECK:             arith.divf {{.*}} : vector<8xf32>
  // CHECK:             vector.store %{{.*}}, %[[SLOPES]][%{{.*}}]
  // CHECK-NOT:         piko.cpu.items
  // CHECK:           } else {
  // CHECK:             scf.for %[[I:.*]] = %[[LOWER]] to %[[UPPER]] step %c1 {
  // CHECK:               piko.storage.item
  // CHECK:               arith.divf
  // CHECK:               memref.store %{{.*}}, %[[SLOPES]][%{{.*}}]
  // CHECK:           scf.for %[[J:.*]] = %[[LOWER]] to %[[UPPER]] step %c1 {
  // CHECK-NOT:         arith.divf
  // CHECK:             piko.get %{{.*}} "first"
  // CHECK:             %[[WORD:.*]] = memref.load %[[SEEN]]
  // CHECK:             %[[IF:.*]] = arith.trunci %[[WORD]] : i32 to i1
  // CHECK:             scf.if %[[IF]] {
  // CHECK:               %[[BESIDE:.*]] = piko.storage.item
  // CHECK:               %[[X:.*]] = piko.get %[[BESIDE]] "x"
  // CHECK:               %[[SLOPE:.*]] = memref.load %[[SLOPES]]
  // CHECK:               %[[PRODUCT:.*]] = arith.mulf %[[X]], %[[SLOPE]]
  // CHECK:               scf.for
  // CHECK:                 arith.mulf %{{.*}}, %[[PRODUCT]]
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %one = arith.constant 1.0 : f32
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Box>
    %units = piko.storage.unit_count %bins : !piko.bins<@Box>
    scf.forall (%u) in (%units) {
      %begin, %end = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Box>
      // expected-remark @+1 {{stage 'a': what follows from a primitive before the loops of its iteration is computed for 8 primitives at once}}
      scf.for %i = %begin to %end step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@Box> -> !piko.prim<@Box>
        %x = piko.get %p "x" : !piko.prim<@Box> -> f32
        %y = piko.get %p "y" : !piko.prim<@Box> -> f32
        %w = piko.get %p "w" : !piko.prim<@Box> -> f32
        %h = piko.get %p "h" : !piko.prim<@Box> -> f32
        %first = piko.get %p "first" : !piko.prim<@Box> -> i32
        %last = piko.get %p "last" : !piko.prim<@Box> -> i32
        %lo = arith.index_cast %first : i32 to index
        %hi = arith.index_cast %last : i32 to index
        %xx = arith.mulf %x, %x : f32
        %yy = arith.mulf %y, %y : f32
        %xy = arith.addf %xx, %yy : f32
        %ww = arith.mulf %w, %w : f32
        %hh = arith.mulf %h, %h : f32
        %wh = arith.addf %ww, %hh : f32
        %area = arith.mulf %xy, %wh : f32
        %seen = arith.cmpf ogt, %area, %zero : f32
        scf.if %seen {
          %slope = arith.divf %one, %area : f32
          %i1 = arith.addi %i, %c1 : index
          %q = piko.storage.item %bins[%i1] : !piko.bins<@Box> -> !piko.prim<@Box>
          %qx = piko.get %q "x" : !piko.prim<@Box> -> f32
          %product = arith.mulf %qx, %slope : f32
          scf.for %j = %lo to %hi step %c1 {
            %old = piko.load checked @color[%j : index] "v" : f32
            %new = arith.mulf %old, %product : f32
            piko.store %new, checked @color[%j : index] "v" : f32
          }
        }
      } {piko.lanes, piko.mapping = #piko<lanes iterations>}
    }
  }

  // Too little is computed, and what is read of state that the kernel changes stays.
  // CHECK-LABEL: piko.kernel @little
  // CHECK-NOT:     memref.alloca
  // CHECK:         scf.for {{.*}} step %c1 {
  // CHECK-NEXT:      piko.storage.item
  // CHECK:           arith.mulf
  // CHECK:           arith.divf
  piko.kernel @little {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@Box>
    %units = piko.storage.unit_count %bins : !piko.bins<@Box>
    scf.forall (%u) in (%units) {
      %begin, %end = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Box>
      scf.for %i = %begin to %end step %c1 {
        %p = piko.storage.item %bins[%i] : !piko.bins<@Box> -> !piko.prim<@Box>
        %x = piko.get %p "x" : !piko.prim<@Box> -> f32
        %first = piko.get %p "first" : !piko.prim<@Box> -> i32
        %lo = arith.index_cast %first : i32 to index
        %xx = arith.mulf %x, %x : f32
        %old = piko.load checked @color[%lo : index] "v" : f32
        %a = arith.divf %old, %xx : f32
        %b = arith.divf %a, %old : f32
        %c = arith.divf %b, %a : f32
        piko.store %c, checked @color[%lo : index] "v" : f32
      } {piko.lanes, piko.mapping = #piko<lanes iterations>}
    }
  }
}
