// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-split-loops),canonicalize,cse)' --split-input-file %s | FileCheck %s

// Where iterations may not agree they are compared, and follow iteration 0; where
// they do not, none runs any more.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Varying
// CHECK:         memref.store %{{.*}}, %[[LEFT:.*]][%c0] : memref<?xindex>
// CHECK:         %[[N:.*]] = memref.load %[[LEFT]][%c0]
// CHECK:         scf.for %[[I:.*]] = %c0 to %[[N]] step %c1 {
// CHECK:           %[[ODD:.*]] = arith.cmpi
// CHECK:           %[[BYTE:.*]] = arith.extui %[[ODD]] : i1 to i8
// CHECK:           memref.store %[[BYTE]], %[[SLOTS:.*]][%[[I]]]
// CHECK:         %[[FIRST:.*]] = arith.trunci %{{.*}} : i8 to i1
// CHECK:         %[[M:.*]] = memref.load %[[LEFT]][%c0]
// CHECK:         scf.for %[[J:.*]] = %c1 to %[[M]] step %c1 iter_args(%[[AGREED:.*]] = %true)
// CHECK:           %[[BYTE:.*]] = memref.load %[[SLOTS]][%[[J]]]
// CHECK:           %[[OWN:.*]] = arith.trunci %[[BYTE]] : i8 to i1
// CHECK:           %[[SAME:.*]] = arith.cmpi eq, %[[OWN]], %[[FIRST]]
// CHECK:           arith.andi %[[AGREED]], %[[SAME]]
// CHECK:           scf.if
// CHECK:             memref.store %c0, %[[LEFT]][%c0]
// CHECK-NEXT:        piko.fail_barrier @a iteration %[[J]]
// CHECK:         %[[CONDITION:.*]] = arith.trunci %{{.*}} : i8 to i1
// CHECK:         scf.if %[[CONDITION]]
// CHECK:           %[[SUM:.*]] = memref.load %{{.*}}[%c0] : memref<?xi32>
// CHECK:           %[[SOME:.*]] = memref.load %[[LEFT]][%c0]
// CHECK:           scf.for %{{.*}} = %c0 to %[[SOME]]
// CHECK:             memref.store %[[SUM]], %[[RESULTS:.*]][
// CHECK:         } else {
// CHECK:           scf.for
// CHECK:             memref.store %{{.*}}, %[[RESULTS]][
// CHECK:         scf.for
// CHECK:           memref.load %[[RESULTS]]
// CHECK:           piko.storage.append
piko.pipeline @Varying rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %c1 = arith.constant 1 : i32
    %c7 = arith.constant 7 : i32
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %int = arith.index_cast %i : index to i32
        %rest = arith.remsi %int, %c7 : i32
        %odd = arith.cmpi sgt, %rest, %c1 : i32
        %r = scf.if %odd -> i32 {
          %s = piko.reduce %int : i32 {
          ^bb0(%a: i32, %b: i32):
            %c = arith.addi %a, %b : i32
            piko.yield results [%c : i32]
          }
          scf.yield %s : i32
        } else {
          scf.yield %int : i32
        }
        %z = arith.sitofp %r : i32 to f32
        %q = piko.storage.append %w[0] (%z) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// What is cheap to compute from the iteration is computed again.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Cheap
// CHECK-NOT:     piko.cpu.scratch
// CHECK:         scf.for
// CHECK:           piko.store
// CHECK:         scf.for %[[I:.*]] = %c0
// CHECK:           %[[NEXT:.*]] = arith.addi %[[I]], %c1
// CHECK:           %[[INT:.*]] = arith.index_cast %[[NEXT]]
// CHECK:           arith.sitofp %[[INT]]
// CHECK-NOT:     piko.cpu.scratch
piko.pipeline @Cheap rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.edge @a[0] -> @b2
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b2 bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %c1 = arith.constant 1 : index
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %next = arith.addi %i, %c1 : index
        %int = arith.index_cast %next : index to i32
        %z = arith.sitofp %int : i32 to f32
        piko.store %z, @b[%i : index] "z" : f32
        piko.sync
        %q = piko.storage.append %w[0] (%z) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// A reduction is a tree of doubling distances; a scan keeps the block left of
// each pair, and then joins the blocks from the left.
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Scan
// CHECK:         scf.while (%[[S:.*]] = %c1)
// CHECK:           arith.cmpi slt, %[[S]], %[[N:.*]] :
// CHECK:         ^bb0(%[[S:.*]]: index):
// CHECK-DAG:       %[[LAST:.*]] = arith.subi %[[N]], %[[S]]
// CHECK-DAG:       %[[STEP:.*]] = arith.addi %[[S]], %[[S]]
// CHECK:           scf.for %[[I:.*]] = %c0 to %[[LAST]] step %[[STEP]]
// CHECK-NEXT:        %[[J:.*]] = arith.addi %[[I]], %[[S]]
// CHECK-NEXT:        %[[A:.*]] = memref.load %[[V:.*]][%[[I]]]
// CHECK-NEXT:        %[[B:.*]] = memref.load %[[V]][%[[J]]]
// CHECK-NEXT:        %[[C:.*]] = arith.addf %[[A]], %[[B]]
// CHECK-NEXT:        memref.store %[[C]], %[[V]][%[[I]]]
// CHECK-NEXT:        memref.store %[[A]], %[[V]][%[[J]]]
// CHECK:         scf.for %[[J:.*]] = %c1 to %[[N]] step %c1 {
// CHECK:           %[[LOW:.*]] = arith.andi %[[J]]
// CHECK:           arith.cmpi ne, %[[J]], %[[LOW]]
// CHECK:           scf.if
// CHECK:             %[[K:.*]] = arith.subi %[[J]], %[[LOW]]
// CHECK:             memref.load %[[V]][%[[K]]]
// CHECK:             arith.addf
// CHECK:         memref.store %cst, %[[V]][%c0]
// CHECK:         scf.for
// CHECK:           memref.load %[[V]]
// CHECK:           piko.storage.append
piko.pipeline @Scan rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %none = arith.constant 0.0 : f32
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %int = arith.index_cast %i : index to i32
        %z = arith.sitofp %int : i32 to f32
        %s = piko.scan %z empty %none : f32 {
        ^bb0(%a: f32, %b: f32):
          %c = arith.addf %a, %b : f32
          piko.yield results [%c : f32]
        }
        %q = piko.storage.append %w[0] (%s) : f32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
