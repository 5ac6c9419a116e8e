// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// A bit of the writer says which version a unit runs.
// CHECK-LABEL: func.func private @P.k(
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[BIT:.*]] = llvm.call @pikoir_takes_vectors_inline(%[[W]], %c1_i64)
// CHECK:         %[[TAKES:.*]] = arith.cmpi ne, %[[BIT]], %c0_i32
// CHECK:         scf.if %[[TAKES]]

// The setup declares loops by number; where some are gone, others move up.
// CHECK-LABEL: func.func @P.setup
// CHECK:         llvm.call @pikoir_declare_mapping(%{{.*}}, %c0_i32, %c-1_i32, %c0_i32, %{{.*}}, %c-1_i32, %c1_i32, %c20_i64, %c10_i64)
// CHECK:         llvm.call @pikoir_declare_mapping(%{{.*}}, %c0_i32, %c-1_i32, %c1_i32, %{{.*}}, %c0_i32, %c0_i32, %c40_i64, %c30_i64)
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %i0 = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %1 = piko.cpu.takes_vectors %w {loop = "inside", number = 5, scalar = 30, vectors = 40, within = 2}
    %0 = piko.cpu.takes_vectors %w {expected, loop = "outside", number = 2, scalar = 10, vectors = 20}
    scf.if %1 {
      piko.store %i0, @out[%c0 : index] "x" : i32
    }
    scf.if %0 {
      piko.store %i0, @out[%c0 : index] "x" : i32
    }
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
