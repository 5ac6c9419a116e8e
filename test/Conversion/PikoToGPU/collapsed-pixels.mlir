// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-to-grids),cse,canonicalize)' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=16},piko-to-grids),cse,canonicalize)' | FileCheck %s --check-prefix=FEW
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64 collapse=false}))' | FileCheck %s --check-prefix=UNSHARED
// UNSHARED-NOT: #piko<threads collapsed>
// UNSHARED:     piko.kernel @kernel_draw
// UNSHARED-NOT: #piko<threads collapsed>

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "toX" : i32 at 8,
                  "toY" : i32 at 12, "edge" : i32 at 16, "step" : i32 at 20}
  size 24 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4

// Threads share the pixels of the boxes of 64 primitives: a mask of 64 bits for
// each of the bin's 64 pixels, and a list of those that have one.
// CHECK-LABEL: piko.kernel @kernel_draw
// CHECK:         gpu.launch {{.*}} threads(%[[T:[a-z0-9]+]],{{.*}} function(@P_kernel_draw)
// CHECK-SAME:      %[[TICKET:[a-z0-9]+]] : memref<1xi32, #gpu.address_space<workgroup>>, %[[LIMIT:[a-z0-9]+]] : memref<1xi32, {{[^,]*}}>, %[[LISTED:[a-z0-9]+]] : memref<1xi32, {{[^,]*}}>, %[[SLOTS:[a-z0-9]+]] : memref<64xi32, {{[^,]*}}>, %[[STARTS:[a-z0-9]+]] : memref<64xi32, {{[^,]*}}>, %[[MASKS:[a-z0-9]+]] : memref<128xi32, {{[^,]*}}>, %[[TOUCHED:[a-z0-9]+]] : memref<2xi32, {{[^,]*}}>, %[[LIST:[a-z0-9]+]] : memref<64xi16,
// The setup of a thread's own primitive: one that uses an array is rare, and so
// is one whose box is not in the bin; the others take a slot.
// CHECK:         scf.while
// CHECK:           scf.if
// CHECK:             piko.storage.item
// CHECK:             scf.if %[[PLAIN:.*]] {
// CHECK:               memref.atomic_rmw addi %{{.*}}, %[[TICKET]]
// CHECK:               memref.atomic_rmw minu %{{.*}}, %[[LIMIT]]
// CHECK:             } else {
// CHECK:               memref.atomic_rmw minu %{{.*}}, %[[LIMIT]]
// CHECK:           gpu.barrier
// The value that the loops hand on has a closed form.
// CHECK:           scf.for
// CHECK-NOT:         piko.store
// CHECK:             arith.muli
// CHECK:             memref.atomic_rmw ori %{{.*}}, %[[MASKS]]
// CHECK:             memref.atomic_rmw ori %{{.*}}, %[[TOUCHED]]
// CHECK:             memref.atomic_rmw addi %{{.*}}, %[[LISTED]]
// CHECK:             memref.store %{{.*}}, %[[LIST]]
// CHECK:           gpu.barrier
// Bits from the lowest on; a pixel is known to be in the bin.
// CHECK:           scf.while
// CHECK:             memref.load %[[LIST]]
// CHECK:             math.cttz
// CHECK-NOT:         piko.fail @draw in %{{.*}} outside bin
// CHECK:             piko.store %{{.*}}, checked @image
// CHECK:           gpu.barrier
// Groups up to the first rare primitive are a launch of their own, which leaves the
// rest of the unit to another one.
// CHECK:           scf.if
// CHECK:             piko.gpu.leave_rest %[[LOG:.*]][%{{.*}}] from %{{.*}}
// CHECK-NOT:     piko.rare
// CHECK:         gpu.launch {{.*}} function(@P_kernel_draw_rest)
// The counters of loops over units and cells are in shared memory, and what
// groups need of the cell, which each use loads.
// CHECK:           scf.while
// CHECK:             piko.gpu.take_units %[[LOG]][%{{.*}}] for rest
// CHECK:             memref.store
// CHECK:             memref.store %{{.*}}, %[[COUNTER:.*]][%c0]
// CHECK-NEXT:      }
// CHECK-NEXT:      gpu.barrier
// CHECK-NEXT:      %[[UNIT:.*]] = memref.load %[[COUNTER]][%c0] {nontemporal = true}
// CHECK:             arith.cmpi ne, %[[UNIT]]
// CHECK:             scf.while
// CHECK:               %[[REST:.*]] = piko.gpu.rest %[[LOG]][%{{.*}}]
// CHECK:               %[[LEFT:.*]] = arith.cmpi ne, %[[REST]], %c0
// CHECK:               arith.select %[[LEFT]]
// CHECK:               memref.store %{{.*}}, %[[END:.*]][%c0] : memref<1xindex
// CHECK:               scf.while
// CHECK-NEXT:            %[[LAST:.*]] = memref.load %[[END]][%c0] {nontemporal = true}
// CHECK-NEXT:            arith.cmpi slt, %{{.*}}, %[[LAST]]
// Threads do a rare one together, in a loop that becomes a function.
// CHECK:           scf.if
// CHECK:             scf.for
// CHECK:               memref.store %{{.*}} : memref<2xi32>
// CHECK:             } {{{.*}}piko.rare}
// CHECK:             gpu.barrier
// CHECK:           gpu.barrier

// A mask of 16 bits needs no other word to say that it is not empty.
// FEW-LABEL: piko.kernel @kernel_draw
// FEW:         gpu.launch
// FEW-SAME:      memref<64xi32, #gpu.address_space<workgroup>>, %{{[a-z0-9]+}} : memref<2xi32
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 64 : @Box -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Box>):
      %x = piko.get %f "x" : !piko.prim<@Box> -> i32
      %y = piko.get %f "y" : !piko.prim<@Box> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Box>):
      %array = memref.alloca() : memref<2xi32>
      %x = piko.get %f "x" : !piko.prim<@Box> -> i32
      %y = piko.get %f "y" : !piko.prim<@Box> -> i32
      %to_x = piko.get %f "toX" : !piko.prim<@Box> -> i32
      %to_y = piko.get %f "toY" : !piko.prim<@Box> -> i32
      %edge = piko.get %f "edge" : !piko.prim<@Box> -> i32
      %step = piko.get %f "step" : !piko.prim<@Box> -> i32
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %at = arith.constant 1 : index
      %plain = arith.cmpi sgt, %step, %zero : i32
      scf.if %plain {
        %end = scf.for %j = %y to %to_y step %one iter_args(%row = %edge) -> (i32) : i32 {
          %last = scf.for %i = %x to %to_x step %one iter_args(%value = %row) -> (i32) : i32 {
            %inside = arith.cmpi sge, %value, %zero : i32
            scf.if %inside {
              piko.update @image[%i, %j : i32, i32] {
              ^bb0(%old: i32):
                %new = arith.muli %old, %value : i32
                piko.yield [%new : i32]
              }
            }
            %next = arith.addi %value, %step : i32
            scf.yield %next : i32
          }
          %down = arith.subi %row, %step : i32
          scf.yield %down : i32
        }
      } else {
        memref.store %edge, %array[%at] : memref<2xi32>
        %which = arith.index_cast %step : i32 to index
        %kept = memref.load %array[%which] : memref<2xi32>
        piko.update @image[%x, %y : i32, i32] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %kept : i32
          piko.yield [%new : i32]
        }
      }
      piko.return
    }
  }
}
