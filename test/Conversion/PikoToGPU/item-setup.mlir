// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-to-grids),cse,canonicalize)' | FileCheck %s

piko.record @Plane {"x" : i32 at 0, "y" : i32 at 4, "toX" : i32 at 8,
                    "toY" : i32 at 12, "dx" : i64 at 16, "dy" : i64 at 24}
  size 32 align 8
piko.record @Pixel {"n" : i64 at 0} size 8 align 8

// A bin has too many pixels for masks, so threads take one primitive after the
// other. What a pixel needs of the setup is loaded before the loops over
// pixels; what a row needs, in each row, if it would take two registers.
// CHECK-LABEL: piko.kernel @kernel_draw
// CHECK:         gpu.launch {{.*}} %[[LONG:[a-z0-9]+]] : memref<128xi64, #gpu.address_space<workgroup>>, %[[SHORT:[a-z0-9]+]] : memref<256xi32, #gpu.address_space<workgroup>>
// CHECK:           gpu.barrier
// CHECK:           scf.for %{{.*}} = %c0_i32
// CHECK:             memref.load %[[SHORT]]
// CHECK-NOT:         nontemporal
// CHECK:             scf.for unsigned %{{.*}} : i32
// CHECK:               %[[DY:.*]] = memref.load %[[LONG]]{{.*}} {nontemporal = true}
// CHECK:               %[[ROW:.*]] = arith.muli %{{.*}}, %[[DY]] : i64
// CHECK:               scf.for unsigned %{{.*}} : i32
// CHECK-NOT:             memref.load %[[LONG]]
// CHECK:                 arith.addi %{{.*}}, %[[ROW]]
// CHECK:                 piko.store
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [64, 64] threads 64 : @Plane -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Plane>):
      %x = piko.get %f "x" : !piko.prim<@Plane> -> i32
      %y = piko.get %f "y" : !piko.prim<@Plane> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Plane>):
      %x = piko.get %f "x" : !piko.prim<@Plane> -> i32
      %y = piko.get %f "y" : !piko.prim<@Plane> -> i32
      %to_x = piko.get %f "toX" : !piko.prim<@Plane> -> i32
      %to_y = piko.get %f "toY" : !piko.prim<@Plane> -> i32
      %dx = piko.get %f "dx" : !piko.prim<@Plane> -> i64
      %dy = piko.get %f "dy" : !piko.prim<@Plane> -> i64
      %one = arith.constant 1 : i32
      scf.for %j = %y to %to_y step %one : i32 {
        %j64 = arith.extsi %j : i32 to i64
        %row = arith.muli %j64, %dy : i64
        scf.for %i = %x to %to_x step %one : i32 {
          %i64 = arith.extsi %i : i32 to i64
          %column = arith.muli %i64, %dx : i64
          %value = arith.addi %column, %row : i64
          piko.update @image[%i, %j : i32, i32] {
          ^bb0(%old: i64):
            %new = arith.addi %old, %value : i64
            piko.yield [%new : i64]
          }
        }
      }
      piko.return
    }
  }
}

// What an array holds is left to the pixels, and so is a branch whose other way hands
// that on: the setup has the branch for the quotient alone.
// CHECK-LABEL: piko.kernel @kernel_pick
// CHECK:         gpu.launch {{.*}} %[[SHORT:[a-z0-9]+]] : memref<192xi32, #gpu.address_space<workgroup>>
// CHECK:             %[[QUOTIENT:.*]] = arith.divsi
// CHECK:             memref.store %[[QUOTIENT]], %[[SHORT]]
// CHECK-NEXT:      }
// CHECK:           gpu.barrier
// CHECK:           scf.for %{{.*}} = %c0_i32
// CHECK:             %[[KEPT:.*]] = memref.load %{{.*}} : memref<4xi32>
// CHECK:             %[[PICKED:.*]] = scf.if
// CHECK:               %[[LOADED:.*]] = memref.load %[[SHORT]]
// CHECK-NEXT:          scf.yield %[[LOADED]]
// CHECK-NEXT:        } else {
// CHECK-NEXT:          scf.yield %[[KEPT]]
// CHECK:             arith.extsi %[[PICKED]]
piko.pipeline @Arrays rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @pick
  piko.stage @pick bins [64, 64] threads 64 : @Plane -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Plane>):
      %x = piko.get %f "x" : !piko.prim<@Plane> -> i32
      %y = piko.get %f "y" : !piko.prim<@Plane> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Plane>):
      %x = piko.get %f "x" : !piko.prim<@Plane> -> i32
      %y = piko.get %f "y" : !piko.prim<@Plane> -> i32
      %to_x = piko.get %f "toX" : !piko.prim<@Plane> -> i32
      %array = memref.alloca() : memref<4xi32>
      %three = arith.constant 3 : i32
      %last = arith.andi %x, %three : i32
      %at = arith.index_castui %last : i32 to index
      memref.store %y, %array[%at] : memref<4xi32>
      %kept = memref.load %array[%at] : memref<4xi32>
      %is_right = arith.cmpi slt, %x, %to_x : i32
      %picked = scf.if %is_right -> (i32) {
        %quotient = arith.divsi %to_x, %three : i32
        scf.yield %quotient : i32
      } else {
        scf.yield %kept : i32
      }
      %wide = arith.extsi %picked : i32 to i64
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%old: i64):
        %new = arith.addi %old, %wide : i64
        piko.yield [%new : i64]
      }
      piko.return
    }
  }
}
