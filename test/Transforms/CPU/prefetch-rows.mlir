// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prefetch),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prefetch,convert-piko-to-scf,canonicalize,cse,piko-plan-vectors{lanes=4},piko-vectorize),canonicalize,cse)' %s | FileCheck %s --check-prefix=LANES

piko.record @Tick {"v" : i32 at 0} size 4 align 4
piko.record @Key {"v" : i32 at 0} size 4 align 4
piko.record @Triangle {"a" : i32 at 0, "b" : i32 at 4} size 8 align 4
piko.record @Corner {"x" : f32 at 0, "y" : f32 at 4, "z" : f32 at 8} size 12 align 4
piko.record @Color {"v" : f32 at 0} size 4 align 4

// A pixel reads a key, by it a triangle, and by that two corners. Before a
// row stand loops that ask for the keys of the third row from there, for the
// triangles of the second one, and for the corners of the next, each if there is
// such a row, and of keys that differ from those of the row before.
// CHECK-LABEL: piko.kernel @kernel_shade
// Keys are asked for where their image is large, whatever the buffers are.
// CHECK:         %[[HI:.*]] = piko.domain[1]
// CHECK:         %[[KEYS0:.*]] = piko.extent @keys[0]
// CHECK:         %[[KEYS1:.*]] = piko.extent @keys[1]
// CHECK:         %[[KEYS:.*]] = arith.muli %[[KEYS0]], %[[KEYS1]]
// CHECK:         arith.cmpi uge, %[[KEYS]], %c262144
// CHECK:         scf.for %[[Y:.*]] = %{{.*}} to %[[HI]] step %c1
// CHECK-NEXT:      %[[LEFT:.*]] = arith.subi %[[HI]], %[[Y]]
// CHECK:           %[[HAS3:.*]] = arith.cmpi sgt, %[[LEFT]], %c3
// CHECK:           scf.if
// CHECK:             %[[Y3:.*]] = arith.addi %[[Y]], %c3
// CHECK:             scf.for %[[X:.*]] =
// CHECK-NEXT:          piko.prefetch @keys[%[[X]], %[[Y3]]
// CHECK-NEXT:        } {piko.lanes}
// CHECK:           scf.if
// CHECK:             %[[Y2:.*]] = arith.addi %[[Y]], %c2
// CHECK:             scf.for %[[X:.*]] =
// CHECK:               %[[NEW:.*]] = piko.load checked @keys[%[[X]], %[[Y2]]
// CHECK:               %[[OLD:.*]] = piko.load checked @keys[%[[X]],
// CHECK:               %[[DIFFER:.*]] = arith.cmpi ne, %[[NEW]], %[[OLD]]
// CHECK:               scf.if
// CHECK:                 piko.prefetch @triangles[
// CHECK:             } {piko.lanes}
// The number of a triangle on the way to its corners is kept inside.
// CHECK:           scf.if
// CHECK:             scf.for
// CHECK:               %[[INSIDE:.*]] = arith.minui
// CHECK:               piko.load checked @triangles[%[[INSIDE]] : index] "a"
// CHECK-NEXT:          piko.prefetch @corners[
// CHECK:               piko.load checked @triangles[%[[INSIDE]] : index] "b"
// CHECK:               piko.prefetch @corners[
// CHECK:             } {piko.lanes}
// CHECK:           scf.for
// CHECK-NOT:         piko.prefetch
// CHECK:             piko.store

// Lanes ask for an element each, and of a row for each line of the cache.
// LANES-LABEL: piko.kernel @kernel_shade
// LANES:         piko.prefetch @keys[
// LANES:         piko.cpu.gather consecutive @keys
// LANES:         vector.reduction <or>
// LANES:         %[[PLACES:.*]] = arith.select %{{.*}} : vector<4xi1>, vector<4xindex>
// LANES:         %[[PLACE0:.*]] = vector.extract %[[PLACES]][0]
// LANES-NEXT:    piko.prefetch @triangles[%[[PLACE0]] : index]
// LANES:         %[[PLACE3:.*]] = vector.extract %[[PLACES]][3]
// LANES-NEXT:    piko.prefetch @triangles[%[[PLACE3]] : index]
// LANES:         piko.cpu.gather @triangles
// LANES-COUNT-4: piko.prefetch @corners[
piko.pipeline @Shaded rank 2 {
  piko.image @keys : @Key rank 2
  piko.buffer @triangles : @Triangle
  piko.buffer @corners : @Corner
  piko.image @color : @Color rank 2
  piko.source @shade
  piko.stage @shade bins [0, 0] threads 64 : @Tick -> [] {}
  piko.kernel @kernel_shade {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @shade : !piko.bins<@Tick>
    %units = piko.storage.unit_count %bins : !piko.bins<@Tick>
    %w = piko.domain[0]
    %h = piko.domain[1]
    scf.forall (%u) in (%units) {
      scf.for %y = %c0 to %h step %c1 {
        scf.for %x = %c0 to %w step %c1 {
          %key = piko.load checked @keys[%x, %y : index, index] "v" : i32
          %zero = arith.constant 0 : i32
          %is_seen = arith.cmpi ne, %key, %zero : i32
          scf.if %is_seen {
            %a = piko.load @triangles[%key : i32] "a" : i32
            %b = piko.load @triangles[%key : i32] "b" : i32
            %ax = piko.load @corners[%a : i32] "x" : f32
            %bx = piko.load @corners[%b : i32] "x" : f32
            %sum = arith.addf %ax, %bx : f32
            piko.store %sum, checked @color[%x, %y : index, index] "v" : f32
          }
        } {piko.lanes}
      }
    }
    piko.storage.close_bins %bins : !piko.bins<@Tick>
  }

  // Nothing is asked for that the loop changes, that is known from one pixel to
  // the next, that a box of few pixels reads, or that does each primitive.
  // CHECK-LABEL: piko.kernel @kernel_others
  // CHECK-NOT:     piko.prefetch
  piko.source @others
  piko.stage @others bins [0, 0] threads 64 : @Tick -> [] {}
  piko.kernel @kernel_others {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @others : !piko.bins<@Tick>
    %units = piko.storage.unit_count %bins : !piko.bins<@Tick>
    %w = piko.domain[0]
    %h = piko.domain[1]
    scf.forall (%u) in (%units) {
      %lo = arith.maxsi %u, %c1 : index
      scf.for %y = %c0 to %h step %c1 {
        scf.for %x = %c0 to %w step %c1 {
          %key = piko.load checked @keys[%x, %y : index, index] "v" : i32
          %a = piko.load @triangles[%key : i32] "a" : i32
          piko.store %a, @triangles[%key : i32] "b" : i32
          %i = arith.addi %x, %y : index
          %c = piko.load @corners[%i : index] "x" : f32
          piko.store %c, checked @color[%x, %y : index, index] "v" : f32
        } {piko.lanes}
        scf.for %x = %lo to %w step %c1 {
          %key = piko.load checked @keys[%x, %y : index, index] "v" : i32
          %c = piko.load @corners[%key : i32] "x" : f32
          piko.store %c, checked @color[%x, %y : index, index] "v" : f32
        } {piko.lanes}
      }
      scf.for %i = %c0 to %w step %c1 {
        %item = piko.storage.item %bins[%i] : !piko.bins<@Tick> -> !piko.prim<@Tick>
        scf.for %y = %c0 to %h step %c1 {
          scf.for %x = %c0 to %w step %c1 {
            %key = piko.load checked @keys[%x, %y : index, index] "v" : i32
            %c = piko.load @corners[%key : i32] "x" : f32
            piko.store %c, checked @color[%x, %y : index, index] "v" : f32
          } {piko.lanes}
        }
      }
    }
    piko.storage.close_bins %bins : !piko.bins<@Tick>
  }
}
