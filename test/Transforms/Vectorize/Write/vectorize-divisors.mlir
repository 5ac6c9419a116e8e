// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' %s | FileCheck %s

// Lanes divide by what all share: where that is neither 0 nor -1, they divide
// without a test of each. Elsewhere each one's dividend is tested, as before.
piko.record @N {"n" : i32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @P
// CHECK:         %[[NONZERO:.*]] = arith.cmpi ne, %[[D:.*]], %c0_i32 : i32
// CHECK:         %[[OTHER:.*]] = arith.cmpi ne, %[[D]], %c-1_i32 : i32
// CHECK:         %[[SURE:.*]] = arith.andi %[[NONZERO]], %[[OTHER]] : i1
// CHECK:         %[[Q:.*]] = scf.if %[[SURE]] -> (vector<16xi32>) {
// CHECK-NOT:       scf.if
// CHECK:           arith.fptosi %{{.*}} : vector<16xf64> to vector<16xi32>
// CHECK-NEXT:      scf.yield
// CHECK:         } else {
// CHECK:           vector.reduction <or>
// CHECK:           piko.fail_divide
piko.pipeline @P rank 1 {
  piko.buffer @in : @N
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @N -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0 : i32
    %minus = arith.constant -1 : i32
    %lowest = arith.constant -2147483648 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@N>
    %n = piko.storage.unit_count %bins : !piko.bins<@N>
    scf.forall (%u) in (%n) {
      %bin = piko.storage.bucket_bin %bins[%c0] : !piko.bins<@N>
      %d = piko.load checked @in[%u : index] "n" : i32
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "n" : i32
        %s = arith.muli %v, %v : i32
        %t = arith.addi %s, %v : i32
        %nonzero = arith.cmpi ne, %d, %zero : i32
        %other = arith.cmpi ne, %d, %minus : i32
        %higher = arith.cmpi ne, %t, %lowest : i32
        %either = arith.ori %higher, %other : i1
        %both = arith.andi %nonzero, %either : i1
        %q = scf.if %both -> (i32) {
          %0 = arith.divsi %t, %d : i32
          scf.yield %0 : i32
        } else {
          piko.fail_divide @a in %bin
          scf.yield %zero : i32
        }
        piko.store %q, checked @out[%x : index] "n" : i32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@N>
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@N>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@N>) -> !piko.bins<@N>
    piko.launch @k(%bins) : (!piko.bins<@N>) -> ()
  }
}
