// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// The image and a copy of a bin's pixels are changed by the same code. Which of
// them is decided by how many primitives the bin has; what pays is asked once.
// CHECK-LABEL: func.func private @P.k(
// CHECK-SAME:      %[[P:[a-z0-9]+]]: !llvm.ptr
// CHECK-DAG:     %[[STATE:.*]] = llvm.call @pikoir_get_state(%[[P]], %c1_i32)
// CHECK-DAG:     %[[DATA:.*]] = llvm.load %[[STATE]] : !llvm.ptr -> !llvm.ptr
// CHECK-DAG:     %[[EXTENT:.*]] = llvm.getelementptr inbounds %[[STATE]][8]
// CHECK-DAG:     %[[WIDTH:.*]] = llvm.load %[[EXTENT]] : !llvm.ptr -> i64
// CHECK-DAG:     %[[LEAST:.*]] = llvm.call @pikoir_tile_least(%[[P]], %c0_i32, %c1_i32)
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[PAYS:.*]] = arith.cmpi sge, %{{.*}}, %[[LEAST]] : i64
// CHECK:         %[[VIEW:.*]]:2 = scf.if %[[PAYS]] -> (!llvm.ptr, i64) {
// CHECK:           %[[TILE:.*]] = llvm.call @pikoir_open_tile(%[[W]], %c1_i32, %c3_i64)
// CHECK:           %[[COPY:.*]] = llvm.load %[[TILE]]
// CHECK:           %[[AT:.*]] = llvm.getelementptr inbounds %[[TILE]][8]
// CHECK:           %[[PITCH:.*]] = llvm.load %[[AT]]
// CHECK:           scf.yield %[[COPY]], %[[PITCH]]
// CHECK:         } else {
// CHECK:           scf.yield %[[DATA]], %[[WIDTH]]
// CHECK:         %[[ROW:.*]] = arith.muli %{{.*}}, %[[VIEW]]#1
// CHECK:         llvm.getelementptr inbounds %[[VIEW]]#0[%
// CHECK:         llvm.store
// What an image's extent is does not change.
// CHECK:         arith.index_cast %[[WIDTH]] : i64 to index
// CHECK:         scf.if %[[PAYS]] {
// CHECK-NEXT:      llvm.call @pikoir_close_tile(%[[W]], %c1_i32)
piko.pipeline @P rank 2 {
  piko.buffer @widths : @F
  piko.image @seen : @F rank 2
  piko.source @a
  piko.stage @a bins [16, 16] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c3 = arith.constant 3 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %begin, %end = piko.storage.bucket_range %bins[%c0, %c3] : !piko.bins<@F>
    %n = arith.subi %end, %begin : index
    %copied = piko.cpu.open_tile @seen[%c3] of %w for %n
    %x = arith.index_cast %begin : index to i32
    piko.store %x, checked @seen[%begin, %end : index, index] "x" : i32
    %width = piko.extent @seen[0]
    %i = arith.index_cast %width : index to i32
    piko.store %i, checked @widths[%c0 : index] "x" : i32
    piko.cpu.close_tile @seen of %w if %copied
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
