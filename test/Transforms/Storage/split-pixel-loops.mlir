// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-split-loops),canonicalize,cse)' --split-input-file %s | FileCheck %s

// Pixels without barriers: rows of them, and what a row's pixels share ahead.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Rows
// CHECK:         scf.for %[[Y:.*]] = %[[Y0:.*]] to %{{.*}} step %c1_i32 : i32 {
// CHECK-NEXT:      %[[SHARED:.*]] = arith.muli %[[Y]], %[[Y]]
// CHECK-NEXT:      scf.for %[[X:.*]] = %[[X0:.*]] to %{{.*}} step %c1_i32 : i32 {
// CHECK-NEXT:        %[[SUM:.*]] = arith.addi %[[X]], %[[SHARED]]
// CHECK:             piko.storage.append
// CHECK-NEXT:      } {piko.lanes}
// CHECK-NEXT:    }
piko.pipeline @Rows rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %lo = arith.constant 3 : i32
    %hi = arith.index_cast %n : index to i32
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_pixels (%lo, %lo) to (%hi, %hi) {
      ^bb0(%x: i32, %y: i32):
        %square = arith.muli %y, %y : i32
        %sum = arith.addi %x, %square : i32
        %v = arith.sitofp %sum : i32 to f32
        %p = piko.storage.append %w[0] (%v) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// Pixels that meet have numbers, from which each piece computes them.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Meeting
// CHECK:         %[[W:.*]] = arith.maxsi
// CHECK:         %[[COUNT:.*]] = arith.muli %[[W]]
// CHECK:         scf.for %[[I:.*]] = %c0 to %[[COUNT]] step %c1 {
// CHECK-DAG:       arith.remui %[[I]], %[[W]]
// CHECK-DAG:       arith.divui %[[I]], %[[W]]
// CHECK:         } {piko.lanes}
// CHECK:         scf.for %{{.*}} = %c0 to %[[COUNT]] step %c1 {
piko.pipeline @Meeting rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %lo = arith.constant 3 : i32
    %hi = arith.index_cast %n : index to i32
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_pixels (%lo, %lo) to (%hi, %hi) {
      ^bb0(%x: i32, %y: i32):
        %sum = arith.addi %x, %y : i32
        %v = arith.sitofp %sum : i32 to f32
        piko.sync
        %p = piko.storage.append %w[0] (%v) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
