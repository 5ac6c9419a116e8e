// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=8},piko-to-grids),cse,canonicalize)' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=1},piko-to-grids))' | FileCheck %s --check-prefix=ONE
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads,piko-to-grids))' | FileCheck %s --check-prefix=STAGE

piko.record @Row {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4

// What pixels need is in an array, so threads take one primitive after the other
// (collapsed-pixels.mlir has many at a time).
//
// A block runs one unit after the other (units.mlir); errors go to the log of the grid. The
// stage's 20 threads become 16.
// CHECK-LABEL: piko.kernel @kernel_draw
// CHECK:         %[[BINS:.*]] = piko.storage.open_bins @draw
// CHECK:         %[[BLOCKS:.*]] = piko.gpu.block_count %[[BINS]] of %c8
// CHECK:         scf.if
// CHECK:           %[[LOG:.*]] = piko.gpu.open_log %[[BINS]]
// CHECK:           gpu.launch blocks({{.*}}) in (%{{[a-z0-9_]+}} = %[[BLOCKS]], {{.*}}) threads(%[[T:[a-z0-9]+]], {{.*}}) in (%{{.*}} = %c8, %{{[^)]*}})
// CHECK-SAME:        workgroup(%{{[a-z0-9]*}} : memref<33xi64, #gpu.address_space<workgroup>>, %[[SETUP:[a-z0-9]*]] : memref<24xi32, #gpu.address_space<workgroup>>, %[[ANY:[a-z0-9]*]] : memref<8xi8, #gpu.address_space<workgroup>>,
// Threads are 4 wide and 2 high.
// CHECK:             %[[TX:.*]] = arith.remui %[[T]], %c4
// CHECK:             %[[ROW:.*]] = arith.divui %[[T]], %c4
// CHECK:             piko.storage.unit_buckets %[[BINS]][
// CHECK:             piko.storage.bucket_range %[[BINS]][%{{.*}},
// Each thread does the setup of one of 8 primitives, and notes which one errors
// are about: fields, and what the pixels need of "to" and "x".
// CHECK:             scf.for %[[BASE:.*]] = %{{.*}} to %{{.*}} step %c8
// CHECK:               %[[MINE:.*]] = arith.addi %[[BASE]], %[[T]]
// CHECK:               scf.if
// CHECK:                 %[[POSITION:.*]] = arith.index_cast %[[MINE]]
// CHECK:                 memref.store %[[POSITION]], %{{.*}}[%c6]
// CHECK:                 %[[ITEM:.*]] = piko.storage.item %{{.*}}[%[[MINE]]]
// CHECK:                 %[[FROM:.*]] = piko.get %[[ITEM]] "x"
// CHECK:                 %[[T8:.*]] = arith.addi %[[T]], %c8
// CHECK:                 memref.store %[[FROM]], %[[SETUP]][%[[T8]]]
// CHECK:                 memref.store %{{.*}}, %[[SETUP]][%[[T]]]
// CHECK:                 %[[TO:.*]] = piko.get %[[ITEM]] "to"
// CHECK:                 %[[D:.*]] = arith.subi %[[TO]], %[[FROM]]
// CHECK:                 %[[T16:.*]] = arith.addi %[[T]], %c16
// CHECK:                 memref.store %[[D]], %[[SETUP]][%[[T16]]]
// CHECK:                 arith.extui
// CHECK:                 memref.store %{{.*}}, %[[ANY]][%[[T]]]
// CHECK:               gpu.barrier
// CHECK-NOT:           piko.get
// CHECK:               scf.for %[[NUMBER:.*]] = %c0_i32 to %{{.*}} : i32
// CHECK-NEXT:            %[[K:.*]] = arith.index_castui %[[NUMBER]]
// CHECK:                 %[[K8:.*]] = arith.addi %[[K]], %c8
// CHECK:                 memref.load %[[SETUP]][%[[K8]]]
// CHECK:                 memref.load %[[SETUP]][%[[K]]]
// The row is under a test of whose it is; the loop along it has a step of 4.
// CHECK:                 arith.shrui %{{.*}}, %c2_i32
// CHECK:                 %[[REST:.*]] = arith.andi %{{.*}}, %c1_i32
// CHECK:                 %[[MINE:.*]] = arith.cmpi eq, %[[REST]], %{{.*}} : i32
// CHECK:                 scf.if %[[MINE]] {
// CHECK:                   scf.for unsigned %{{.*}} = %c0
// CHECK:                     arith.muli %{{.*}}, %c4_i32
// CHECK:                     piko.load checked @image[
// CHECK:                     piko.store %{{.*}}, checked @image[
// CHECK:                     piko.fail @draw in %{{.*}} outside bin of @image(
// CHECK:               gpu.barrier
// CHECK:             piko.gpu.flush %[[LOG]][%{{.*}}]
// CHECK-NEXT:        gpu.barrier
// CHECK:           gpu.terminator
// CHECK:           piko.gpu.close_log %[[LOG]]
// CHECK:         piko.storage.close_bins %[[BINS]]

// A thread that has a block for itself has all its pixels.
// ONE-LABEL: piko.kernel @kernel_draw
// ONE:         gpu.launch
// ONE-NOT:     arith.andi %{{.*}} : i32
// ONE:         gpu.terminator

// STAGE-LABEL: piko.kernel @kernel_draw
// STAGE:         workgroup({{.*}} : memref<48xi32, #gpu.address_space<workgroup>>
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 20 : @Row -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %to = piko.get %f "to" : !piko.prim<@Row> -> i32
      %one = arith.constant 1 : i32
      %at = arith.constant 0 : index
      %added = memref.alloca() : memref<1xi32>
      memref.store %one, %added[%at] : memref<1xi32>
      scf.while (%i = %x) : (i32) -> (i32) {
        %more = arith.cmpi slt, %i, %to : i32
        scf.condition(%more) %i : i32
      } do {
      ^bb0(%i: i32):
        %n = memref.load %added[%at] : memref<1xi32>
        piko.update @image[%i, %y : i32, i32] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %n : i32
          piko.yield [%new : i32]
        }
        %next = arith.addi %i, %one : i32
        scf.yield %next : i32
      }
      piko.return
    }
  }
}
