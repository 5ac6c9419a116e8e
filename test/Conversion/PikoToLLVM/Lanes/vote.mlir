// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// Where there are no lanes, a vote is the condition.
// CHECK-LABEL: func.func private @P.k(
// CHECK-NOT:     piko.cpu.vote
// CHECK:         %[[IS:.*]] = arith.cmpi ugt
// CHECK:         scf.if %[[IS]]
// CHECK:           llvm.store
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %i0 = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %is = arith.cmpi ugt, %n, %c0 : index
    %all = piko.cpu.vote %is
    scf.if %all {
      piko.store %i0, @out[%c0 : index] "x" : i32
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
