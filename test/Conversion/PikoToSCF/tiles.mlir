// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A tile is an array for each field, with the rows of pixels in a row.
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-units,convert-piko-to-scf),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --piko-to-cpu %s | FileCheck %s --check-prefix=LLVM

piko.record @Pixel {"z" : f32 at 0, "n" : i32[2 : 4] at 4} size 12 align 4
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// A bin in which nothing is has no tile.
// CHECK:         %[[BINS:.*]] = piko.storage.open_bins @a
// CHECK:         %[[BEGIN:.*]], %[[END:.*]] = piko.storage.cell_range
// CHECK:         %[[FILLED:.*]] = arith.cmpi ne, %[[BEGIN]], %[[END]]
// CHECK:         scf.if %[[FILLED]] {
// CHECK-DAG:       %[[Z:.*]] = memref.alloca() {alignment = 64 : i64} : memref<4x8xf32>
// CHECK-DAG:       %[[N:.*]] = memref.alloca() {alignment = 64 : i64} : memref<2x4x8xi32>
// CHECK:           %[[CLEARS:.*]] = piko.storage.clears %[[BINS]]
// In the first launch the whole array gets the clear value,
// CHECK:           scf.if %[[CLEARS]] {
// CHECK:             memref.store %{{.*}}, %[[Z]][%{{.*}}, %{{.*}}]
// in others what of the bin is in the domain is read.
// CHECK:           } else {
// CHECK:             %[[OLD:.*]] = piko.load checked @image[%{{.*}}, %{{.*}} : index, index] "z" : f32
// CHECK:             memref.store %[[OLD]], %[[Z]][%[[ROW:.*]], %[[COLUMN:.*]]]
// An access is at the place in the bin.
// CHECK:             %[[COLUMN:.*]] = arith.subi
// CHECK:             %[[ROW:.*]] = arith.subi
// CHECK:             memref.load %[[Z]][%[[ROW]], %[[COLUMN]]]
// CHECK:             memref.store %{{.*}}, %[[Z]][%[[ROW]], %[[COLUMN]]]
// CHECK:           } {piko.lanes}
// At the end all of the bin is written.
// CHECK:             %[[NEW:.*]] = memref.load %[[N]][%c1, %{{.*}}, %{{.*}}]
// CHECK:             piko.store %[[NEW]], checked @image[%{{.*}}, %{{.*}} : index, index] "n"[%c1] : i32

// LLVM:        call @pikoir_declare_clears
// LLVM-NOT:    @pikoir_clear(
piko.pipeline @P rank 2 {
  piko.image @image : @Pixel rank 2 clear [1.0 : f32, 2 : i32, 3 : i32]
  piko.source @a
  piko.stage @a bins [8, 4] threads 1 ordered : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image clear in %bin : !piko.tile<@Pixel, [8, 4]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %y = piko.get %f "y" : !piko.prim<@F> -> i32
        piko.update @image[%x, %y : i32, i32] in %bin tile(%t : !piko.tile<@Pixel, [8, 4]>) {
        ^bb0(%z: f32, %n: i32, %m: i32):
          %twice = arith.addf %z, %z : f32
          piko.yield [%twice, %n, %m : f32, i32, i32]
        }
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@Pixel, [8, 4]>
    }
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @k(%bins) clears @image : (!piko.bins<@F>) -> ()
  }
}
