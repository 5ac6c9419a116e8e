// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-to-grids),cse,canonicalize)' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=16},piko-to-grids))' | FileCheck %s --check-prefix=FEW
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-to-grids{without=compact-work}),cse,canonicalize)' | FileCheck %s --check-prefix=PLAIN
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-form-grids,piko-share-loops,piko-compact-work),cse,canonicalize)' | FileCheck %s --check-prefix=QUEUE
// PLAIN-LABEL: piko.kernel @kernel_draw
// PLAIN-NOT:     memref<192xi32
// PLAIN:         piko.storage.close_bins

// The loop leaves what the branch needs in a queue, and the branch is in its drain.
// QUEUE-LABEL: piko.kernel @kernel_draw
// QUEUE:         scf.for %[[I:.*]] = %[[BEGIN:.*]] to %{{.*}} step %c1 {
// QUEUE:           %[[SLOT:.*]] = memref.atomic_rmw addi %c1_i32, %[[COUNT:.*]][%c0]
// QUEUE:           %[[ENTRY:.*]] = arith.index_cast %[[SLOT]]
// QUEUE:           memref.store %{{.*}}, %[[CLASSES:.*]][%[[ENTRY]]]
// QUEUE-COUNT-5:   memref.store %{{.*}}, %[[NEEDS:.*]][%
// QUEUE-NOT:       piko.atomic
// QUEUE:         } {piko.shared}
// QUEUE-NEXT:    piko.gpu.drain %[[COUNT]], %[[LENGTHS:.*]], %[[STARTS:.*]], %[[CLASSES]], %[[ORDER:.*]] : memref<1xi32,
// QUEUE-NEXT:    ^bb0(%[[AT:.*]]: index):
// QUEUE:           memref.load %[[NEEDS]]
// QUEUE:           scf.while
// QUEUE:             piko.atomic add @image
// QUEUE-LABEL: piko.kernel @kernel_look
// QUEUE-NOT:     piko.gpu.drain

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "width" : i32 at 8,
                  "height" : i32 at 12} size 16 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4

// Boxes with a width wait in shared memory: four numbers each, and which
// primitive it is.
// CHECK-LABEL: piko.kernel @kernel_draw
// CHECK:         gpu.launch {{.*}} threads(%[[T:[a-z0-9]+]],
// CHECK-SAME:      %[[COUNT:[a-z0-9]+]] : memref<1xi32, #gpu.address_space<workgroup>>, %[[LENGTHS:[a-z0-9]+]] : memref<32xi32, {{[^,]*}}>, %[[STARTS:[a-z0-9]+]] : memref<32xi32, {{[^,]*}}>, %[[CLASSES:[a-z0-9]+]] : memref<192xi32, {{[^,]*}}>, %[[ORDER:[a-z0-9]+]] : memref<192xi16, {{[^,]*}}>, %[[NEEDS:[a-z0-9]+]] : memref<960xi32,
// CHECK:           memref.store %c0_i32, %[[COUNT]]
// CHECK:           scf.for
// CHECK:             scf.if
// CHECK:               %[[SLOT:.*]] = memref.atomic_rmw addi %c1_i32, %[[COUNT]]
// The class is that of as many iterations as both loops have together.
// CHECK:               arith.muli
// CHECK:               memref.atomic_rmw addi %c1_i32, %[[LENGTHS]]
// CHECK:               memref.store %{{.*}}, %[[CLASSES]]
// CHECK-COUNT-5:       memref.store %{{.*}}, %[[NEEDS]]
// CHECK:             piko.gpu.flush
// CHECK:             gpu.barrier
// CHECK:             %[[WAITING:.*]] = memref.load %[[COUNT]]
// CHECK:             gpu.barrier
// CHECK:             arith.cmpi sgt, %[[WAITING]], %c128_i32
// CHECK:             scf.if
// CHECK:               memref.store %{{.*}}, %[[STARTS]]
// CHECK:               memref.store %{{.*}}, %[[ORDER]]
// CHECK:               gpu.barrier
// CHECK:               scf.for %{{.*}} = %[[T]] to %{{.*}} step %c64
// CHECK:                 memref.load %[[ORDER]]
// CHECK:                 scf.while (%{{.*}} = %{{.*}}, %{{.*}} = %{{.*}}) : (i32, i32) -> (i32, i32)
// CHECK:                   piko.atomic add checked @image
// CHECK:               memref.store %c0_i32, %[[COUNT]]
// CHECK:               gpu.barrier

// Too few threads to have loops of all lengths at a time.
// FEW-LABEL: piko.kernel @kernel_draw
// FEW:         gpu.launch
// FEW-NOT:       memref.atomic_rmw
// FEW:         gpu.terminator

// What a loop has done is read: it stays where it is.
// CHECK-LABEL: piko.kernel @kernel_look
// CHECK:         gpu.launch
// CHECK-NOT:       memref.atomic_rmw
// CHECK:         gpu.terminator
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2
  piko.image @other : @Pixel rank 2
  piko.source @draw
  piko.source @look
  piko.stage @draw bins [0, 0] threads 64 : @Box -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Box>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Box>):
      %x = piko.get %f "x" : !piko.prim<@Box> -> i32
      %y = piko.get %f "y" : !piko.prim<@Box> -> i32
      %width = piko.get %f "width" : !piko.prim<@Box> -> i32
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %some = arith.cmpi sgt, %width, %zero : i32
      scf.if %some {
        %height = piko.get %f "height" : !piko.prim<@Box> -> i32
        %last = scf.while (%j = %zero) : (i32) -> i32 {
          %more = arith.cmpi sle, %j, %height : i32
          scf.condition(%more) %j : i32
        } do {
        ^bb0(%j: i32):
          %end = scf.while (%i = %zero) : (i32) -> i32 {
            %more = arith.cmpi slt, %i, %width : i32
            scf.condition(%more) %i : i32
          } do {
          ^bb0(%i: i32):
            %px = arith.addi %x, %i : i32
            %py = arith.addi %y, %j : i32
            piko.atomic add @image[%px, %py : i32, i32] "n", %one : i32
            %next = arith.addi %i, %one : i32
            scf.yield %next : i32
          }
          %down = arith.addi %j, %one : i32
          scf.yield %down : i32
        }
      }
      piko.return
    }
  }
  piko.stage @look bins [0, 0] threads 64 : @Box -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Box>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Box>):
      %x = piko.get %f "x" : !piko.prim<@Box> -> i32
      %width = piko.get %f "width" : !piko.prim<@Box> -> i32
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      scf.for %i = %zero to %width step %one : i32 {
        %seen = piko.load @other[%i, %zero : i32, i32] "n" : i32
        piko.atomic add @other[%x, %zero : i32, i32] "n", %seen : i32
      }
      piko.return
    }
  }
}
