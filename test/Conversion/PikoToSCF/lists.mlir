// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(convert-piko-to-scf),canonicalize,cse)' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// A list is a range of positions. The index of a loop over the list is inside,
// any other is tested; a primitive of zeros stands for what is not there.
// CHECK-LABEL: piko.kernel @k
// CHECK:         %[[LO:.*]], %[[HI:.*]] = piko.storage.call_range %[[BINS:.*]][
// CHECK:         %[[SIZE:.*]] = arith.subi %[[HI]], %[[LO]]
// CHECK:         scf.for %[[I:.*]] = %c0 to %[[SIZE]] step %c1 {
// CHECK-NEXT:      %[[AT:.*]] = arith.addi %[[LO]], %[[I]]
// CHECK-NEXT:      %[[P:.*]] = piko.storage.item %[[BINS]][%[[AT]]]
// CHECK-NEXT:      piko.get %[[P]] "x"
// CHECK:           %[[NEXT:.*]] = arith.addi %[[I]], %c1
// CHECK-NEXT:      %[[INSIDE:.*]] = arith.cmpi ult, %[[NEXT]], %[[SIZE]]
// CHECK-NEXT:      %[[Q:.*]] = scf.if %[[INSIDE]] -> (!piko.prim<@F>) {
// CHECK-NEXT:        %[[THERE:.*]] = arith.addi %[[LO]], %[[NEXT]]
// CHECK-NEXT:        %[[ITEM:.*]] = piko.storage.item %[[BINS]][%[[THERE]]]
// CHECK-NEXT:        scf.yield %[[ITEM]]
// CHECK-NEXT:      } else {
// CHECK-NEXT:        piko.fail_list @a at %[[NEXT]] of %[[SIZE]]
// CHECK-NEXT:        %[[ZEROS:.*]] = piko.storage.no_item
// CHECK-NEXT:        scf.yield %[[ZEROS]]
// CHECK:           piko.get %[[Q]] "x"
// CHECK-NOT:     piko.storage.list
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %lo, %hi = piko.storage.call_range %bins[%c0] : !piko.bins<@F>
    %l = piko.storage.list %bins[%lo to %hi] : !piko.bins<@F> -> !piko.list<@F>
    %n = piko.list_size %l : !piko.list<@F>
    scf.for %i = %c0 to %n step %c1 {
      %p = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
      %x = piko.get %p "x" : !piko.prim<@F> -> i32
      piko.store %x, checked @out[%i : index] "x" : i32
      %j = arith.addi %i, %c1 : index
      %q = piko.list_at %l[%j] : !piko.list<@F> -> !piko.prim<@F>
      %y = piko.get %q "x" : !piko.prim<@F> -> i32
      piko.store %y, checked @out[%j : index] "x" : i32
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
