// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A tile stays in the image, and its rows are cleared when the bin begins; or it
// is an array for each type of numbers.
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-units,convert-piko-to-scf),canonicalize,cse)' %s | FileCheck %s --check-prefixes=CHECK,COPY
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-units,convert-piko-to-scf{private-tiles=true}),canonicalize,cse)' %s | FileCheck %s --check-prefix=PRIVATE
// RUN: piko-opt --piko-to-cpu %s | FileCheck %s --check-prefix=LLVM

piko.record @Pixel {"z" : f32 at 0, "n" : i32[2 : 4] at 4} size 12 align 4
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// A bin in which nothing is is passed over: the runtime has cleared it.
// CHECK-DAG:     %[[ONE:.*]] = arith.constant 1.000000e+00 : f32
// CHECK-DAG:     %[[THREE:.*]] = arith.constant 3 : i32
// CHECK:         %[[BINS:.*]] = piko.storage.open_bins @a
// CHECK:         %[[BEGIN:.*]], %[[END:.*]] = piko.storage.bucket_range
// CHECK:         %[[FILLED:.*]] = arith.cmpi ne, %[[BEGIN]], %[[END]]
// CHECK:         scf.if %[[FILLED]] {
// CHECK-NOT:       memref.alloca
// CHECK:           %[[CLEARS:.*]] = piko.storage.clears %[[BINS]]
// CHECK:           scf.if %[[CLEARS]] {
// CHECK:             piko.store %[[ONE]], checked @image[%[[X:.*]], %[[Y:.*]] : index, index] "z" : f32
// CHECK:             piko.store %[[THREE]], checked @image[%[[X]], %[[Y]] : index, index] "n"[%c1] : i32
// CHECK:             piko.load checked @image[%{{.*}}, %{{.*}} : index, index] "z" : f32
// CHECK:           } {piko.lanes}
// CHECK-NOT:       piko.store

// PRIVATE:       scf.if %{{.*}} {
// PRIVATE-DAG:     %[[Z:.*]] = memref.alloca() {alignment = 64 : i64} : memref<32xf32>
// PRIVATE-DAG:     %[[N:.*]] = memref.alloca() {alignment = 64 : i64} : memref<64xi32>
// PRIVATE:         %[[CLEARS:.*]] = piko.storage.clears
// In the first launch the whole array gets the clear value,
// PRIVATE:         scf.if %[[CLEARS]] {
// PRIVATE:           memref.store %{{.*}}, %[[Z]][%{{.*}}] : memref
// in others what of the bin is in the domain is read.
// PRIVATE:         } else {
// PRIVATE:           %[[OLD:.*]] = piko.load checked @image[%{{.*}}, %{{.*}} : index, index] "z" : f32
// PRIVATE:           memref.store %[[OLD]], %[[Z]][%{{.*}}]
// An access is at the place in the bin.
// PRIVATE:           %[[COLUMN:.*]] = arith.subi
// PRIVATE:           %[[ROW:.*]] = arith.subi
// PRIVATE:           %[[BEFORE:.*]] = arith.muli %[[ROW]], %c8
// PRIVATE:           %[[AT:.*]] = arith.addi %[[BEFORE]], %[[COLUMN]]
// PRIVATE:           memref.load %[[Z]][%[[AT]]]
// PRIVATE:           memref.store %{{.*}}, %[[Z]][%[[AT]]]
// PRIVATE:         } {piko.lanes}
// At the end all of the bin is written.
// PRIVATE:           %[[TWICE:.*]] = arith.muli %{{.*}}, %c2
// PRIVATE:           %[[SECOND:.*]] = arith.addi %[[TWICE]], %c1
// PRIVATE:           %[[NEW:.*]] = memref.load %[[N]][%[[SECOND]]]
// PRIVATE:           piko.store %[[NEW]], checked @image[%{{.*}}, %{{.*}} : index, index] "n"[%c1] : i32

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

// Of a tile with more than eight rows the runtime may make a copy, if it begins
// with what is in the image.
// COPY-LABEL:  piko.pipeline @Copies
// COPY:          %[[W:.*]] = piko.cpu.open_writer
// COPY:          %[[BEGIN:.*]], %[[END:.*]] = piko.storage.bucket_range
// COPY:          scf.if
// COPY:            %[[COUNT:.*]] = arith.subi %[[END]], %[[BEGIN]]
// COPY-NOT:        piko.cpu.open_tile @image
// COPY:            %[[COPIED:.*]] = piko.cpu.open_tile @kept[%{{.*}}] of %[[W]] for %[[COUNT]]
// COPY:            scf.for
// COPY-NOT:        piko.cpu.close_tile @image
// COPY:            piko.cpu.close_tile @kept of %[[W]] if %[[COPIED]]
piko.pipeline @Copies rank 2 {
  piko.image @image : @Pixel rank 2 clear [1.0 : f32, 2 : i32, 3 : i32]
  piko.image @kept : @F rank 2
  piko.source @a
  piko.stage @a bins [8, 16] threads 1 ordered : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image clear in %bin : !piko.tile<@Pixel, [8, 16]>
      %s = piko.tile @kept in %bin : !piko.tile<@F, [8, 16]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %y = piko.get %f "y" : !piko.prim<@F> -> i32
        piko.update @image[%x, %y : i32, i32] in %bin tile(%t : !piko.tile<@Pixel, [8, 16]>) {
        ^bb0(%z: f32, %n: i32, %m: i32):
          %twice = arith.addf %z, %z : f32
          piko.yield [%twice, %n, %m : f32, i32, i32]
        }
        piko.update @kept[%x, %y : i32, i32] in %bin tile(%s : !piko.tile<@F, [8, 16]>) {
        ^bb0(%n: i32, %m: i32):
          piko.yield [%x, %m : i32, i32]
        }
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@Pixel, [8, 16]>
      piko.write_tile %s to @kept in %bin : !piko.tile<@F, [8, 16]>
    }
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @k(%bins) clears @image : (!piko.bins<@F>) -> ()
  }
}
