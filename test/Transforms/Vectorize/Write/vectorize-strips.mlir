// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @V {"z" : f32 at 0} size 4 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.image @out : @V rank 2
  piko.buffer @slopes : @N
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @V -> [] {}

  // Of a strip hardly any vector is empty: what a pixel does is masked, and has no
  // branch around it.
  // CHECK-LABEL: piko.kernel @strip
  // CHECK:         scf.if %{{.*}} {
  // CHECK-NOT:       scf.if
  // CHECK:           piko.cpu.gather consecutive @out
  // CHECK-NOT:       scf.if
  // CHECK:           piko.cpu.scatter %{{.*}}, consecutive @out
  piko.kernel @strip {
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : i32
    %c16 = arith.constant 16 : i32
    %end = arith.constant 61 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %left = arith.index_cast %u : index to i32
      %slope = piko.load checked @slopes[%u : index] "n" : i32
      %next = arith.addi %left, %c16 overflow<nsw> : i32
      %right = arith.minsi %next, %end : i32
      %at = arith.index_cast %left : i32 to index
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
      scf.for %x = %left to %right step %one : i32 {
        %column = arith.index_cast %x : i32 to index
        %px = arith.muli %x, %slope : i32
        %e = arith.subi %px, %left : i32
        %isIn = arith.cmpi sge, %e, %zero : i32
        scf.if %isIn {
          %z = arith.sitofp %e : i32 to f32
          %z2 = arith.mulf %z, %z : f32
          %z3 = arith.mulf %z2, %z : f32
          %z4 = arith.addf %z3, %z2 : f32
          %z5 = arith.addf %z4, %z : f32
          %old = piko.load checked @out[%column, %at : index, index] "z" : f32
          %isNearer = arith.cmpf ogt, %z5, %old : f32
          scf.if %isNearer {
            piko.store %z5, checked @out[%column, %at : index, index] "z" : f32
          }
        }
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }

  // A division takes longer than a branch.
  // CHECK-LABEL: piko.kernel @divides
  // CHECK:         %[[ANY:.*]] = vector.reduction <or>
  // CHECK:         scf.if %[[ANY]] {
  // CHECK:           arith.divf
  // CHECK:           piko.cpu.gather consecutive @out
  // CHECK-NOT:       scf.if
  // CHECK:           piko.cpu.scatter %{{.*}}, consecutive @out
  piko.kernel @divides {
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : i32
    %c16 = arith.constant 16 : i32
    %end = arith.constant 61 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %left = arith.index_cast %u : index to i32
      %slope = piko.load checked @slopes[%u : index] "n" : i32
      %next = arith.addi %left, %c16 overflow<nsw> : i32
      %right = arith.minsi %next, %end : i32
      %at = arith.index_cast %left : i32 to index
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
      scf.for %x = %left to %right step %one : i32 {
        %column = arith.index_cast %x : i32 to index
        %px = arith.muli %x, %slope : i32
        %e = arith.subi %px, %left : i32
        %isIn = arith.cmpi sge, %e, %zero : i32
        scf.if %isIn {
          %z = arith.sitofp %e : i32 to f32
          %z2 = arith.mulf %z, %z : f32
          %z3 = arith.mulf %z2, %z : f32
          %z4 = arith.addf %z3, %z2 : f32
          %z5 = arith.divf %z4, %z : f32
          %old = piko.load checked @out[%column, %at : index, index] "z" : f32
          %isNearer = arith.cmpf ogt, %z5, %old : f32
          scf.if %isNearer {
            piko.store %z5, checked @out[%column, %at : index, index] "z" : f32
          }
        }
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
