// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-split-loops),canonicalize,cse)' --split-input-file %s | FileCheck %s

piko.record @F {"z" : f32 at 0} size 4 align 4

// Without barriers: a loop, and one in it for the inner one.
// CHECK-LABEL: piko.pipeline @Plain
// CHECK:         scf.for %[[I:.*]] = %c0 to %{{.*}} step %c1 {
// CHECK-NEXT:      scf.for %{{.*}} = %c0 to %[[I]] step %c1 {
// CHECK-NEXT:        piko.storage.append
// CHECK-NEXT:      } {piko.lanes}
// CHECK-NEXT:    } {piko.lanes}
// CHECK-NOT:     piko.cpu.scratch
piko.pipeline @Plain rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %v = arith.constant 1.0 : f32
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        piko.parallel_for %i {
        ^bb0(%j: index):
          %p = piko.storage.append %w[0] (%v) : f32 -> !piko.prim<@F>
          piko.yield
        }
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// A value and a private array across a barrier; what all iterations share needs
// no slot. Primitives are kept by their addresses. One piece emits, so its order
// is right.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Across
// CHECK:         %[[SHARED:.*]] = arith.addi
// CHECK:         %[[ANY:.*]] = arith.cmpi sgt, %[[N:.*]], %c0
// CHECK:         scf.if %[[ANY]] {
// CHECK:           %[[MARK:.*]] = piko.cpu.scratch_mark %[[W:.*]]
// CHECK:           %[[BYTES:.*]], %[[GRANTED:.*]] = piko.cpu.scratch %[[W]]
// CHECK:           scf.if %[[GRANTED]] {
// CHECK-DAG:         %[[VALUES:.*]] = memref.view %[[BYTES]][{{.*}}][%[[N]]] : memref<?xi8> to memref<?xf32>
// CHECK-DAG:         %[[PRIMS:.*]] = memref.view %[[BYTES]][{{.*}}][%[[N]]] : memref<?xi8> to memref<?xindex>
// CHECK:             scf.for %[[I:.*]] = %c0 to %[[N]] step %c1 {
// CHECK:               %[[ARRAY:.*]] = memref.view %[[BYTES]][{{.*}}][] : memref<?xi8> to memref<4xf32>
// CHECK-DAG:           memref.store %{{.*}}, %[[VALUES]][%[[I]]]
// CHECK-DAG:           memref.store %{{.*}}, %[[PRIMS]][%[[I]]]
// CHECK-DAG:           memref.store %{{.*}}, %[[ARRAY]][%[[SHARED]]]
// CHECK:             } {piko.lanes}
// CHECK:             scf.for %[[J:.*]] = %c0 to %[[N]] step %c1 {
// CHECK-DAG:           memref.load %[[VALUES]][%[[J]]]
// CHECK-DAG:           %[[ADDRESS:.*]] = memref.load %[[PRIMS]][%[[J]]]
// CHECK-DAG:           piko.storage.from_address %[[ADDRESS]]
// CHECK-DAG:           %[[SAME:.*]] = memref.view %[[BYTES]][{{.*}}][] : memref<?xi8> to memref<4xf32>
// CHECK:               memref.load %[[SAME]][%[[SHARED]]]
// CHECK:               piko.storage.append
// CHECK:             } {piko.lanes}
// CHECK:           piko.cpu.scratch_release %[[W]][%[[MARK]]]
// CHECK-NOT:     piko.reorder
piko.pipeline @Across rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : list @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %c1 = arith.constant 1 : index
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %l = piko.storage.list %bins[%u to %n] : !piko.bins<@F> -> !piko.list<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %array = memref.alloca() : memref<4xf32>
        %shared = arith.addi %n, %c1 : index
        %p = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
        %z = piko.get %p "z" : !piko.prim<@F> -> f32
        memref.store %z, %array[%shared] : memref<4xf32>
        piko.sync
        %y = memref.load %array[%shared] : memref<4xf32>
        %x = piko.get %p "z" : !piko.prim<@F> -> f32
        %s = arith.addf %y, %z : f32
        %t = arith.addf %s, %x : f32
        %q = piko.storage.append %w[0] (%t) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// A loop that holds a barrier moves around the pieces. Its condition is the same
// in all iterations, because it starts and ends alike: nothing is compared. It
// emits more than once, so emissions wait for their order.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Uniform
// CHECK:         piko.cpu.reorder_begin %[[W:.*]][%[[N:.*]]]
// CHECK:         scf.for %{{.*}} = %c0 to %[[N]]
// CHECK:         scf.while
// CHECK:           scf.for
// CHECK:           scf.condition
// CHECK:         } do {
// CHECK:           scf.for %[[I:.*]] = %c0 to %[[N]] step %c1 {
// CHECK:             piko.cpu.reorder_iteration %[[W]][%[[I]]]
// CHECK:             piko.storage.append
// CHECK:           scf.for
// CHECK:         piko.cpu.reorder_end %[[W]]
// CHECK-NOT:     piko.fail_barrier
piko.pipeline @Uniform rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %c1 = arith.constant 1 : index
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %end = scf.while (%s = %c1) : (index) -> index {
          %on = arith.cmpi slt, %s, %n : index
          scf.condition(%on) %s : index
        } do {
        ^bb0(%s: index):
          %int = arith.index_cast %i : index to i32
          %z = arith.sitofp %int : i32 to f32
          %q = piko.storage.append %w[0] (%z) : f32 -> !piko.prim<@F>
          piko.sync
          %t = arith.addi %s, %s : index
          scf.yield %t : index
        }
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
