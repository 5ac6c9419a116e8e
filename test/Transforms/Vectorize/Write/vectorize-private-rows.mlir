// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' %s | FileCheck %s

// Lanes that change elements side by side of a private copy do so at once.
// Elsewhere each changes its own: they may change one element.
piko.record @F {"n" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Rows
// CHECK:         %[[COPY:.*]] = piko.cpu.private_copy add @hits "n"
// CHECK:         scf.for %[[X:.*]] = %c0 to %{{.*}} step %c16
// CHECK:           piko.cpu.reduce_row add %{{.*}}, @hits[%[[X]], %{{.*}}] "n" mask %{{.*}} in %[[COPY]] : vector<16xi1>, vector<16xi32>
// CHECK-NOT:       piko.cpu.reduce_row
// CHECK:           piko.atomic add checked @hits[%{{.*}}] "n", %{{.*}} in %[[COPY]] : i32
// CHECK:           piko.cpu.reduce_row add
piko.pipeline @Rows rank 2 {
  piko.image @hits : @F rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %one = arith.constant 1 : i32
    %seven = arith.constant 7 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %copy = piko.cpu.private_copy add @hits "n" of %w often
      scf.for %x = %c0 to %n step %c1 {
        %v = arith.index_cast %x : index to i32
        piko.atomic add checked @hits[%x, %u : index, index] "n", %v in %copy : i32
        %low = arith.andi %x, %seven : index
        piko.atomic add checked @hits[%low, %u : index, index] "n", %one in %copy : i32
        %a = arith.muli %v, %v : i32
        %b = arith.xori %a, %v : i32
        %c = arith.muli %b, %a : i32
        %d = arith.xori %c, %b : i32
        %e = arith.muli %d, %c : i32
        piko.atomic add checked @hits[%x, %n : index, index] "n", %e in %copy : i32
      } {piko.lanes}
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
