// RUN: piko-opt %s --canonicalize='test-convergence' | FileCheck %s
// A field of a primitive that was just stored is the value that was stored.

piko.record @F {"x" : i32 at 0, "w" : i32[2 : 8, 2 : 4] at 4} size 20 align 4

// CHECK-LABEL: piko.pipeline @Forward
piko.pipeline @Forward rank 2 {
  piko.buffer @out : @F
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  piko.kernel @kernel_a {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c2 = arith.constant 2 : index
    %v0 = arith.constant 10 : i32
    %v1 = arith.constant 11 : i32
    %v2 = arith.constant 12 : i32
    %v3 = arith.constant 13 : i32
    %v4 = arith.constant 14 : i32
    %n = piko.extent @out[0]
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %p = piko.storage.append %w[0] (%v0, %v1, %v2, %v3, %v4) : i32, i32, i32, i32, i32 -> !piko.prim<@F>
    // CHECK-DAG: %[[X:.*]] = arith.constant 10 : i32
    // CHECK-DAG: %[[W10:.*]] = arith.constant 13 : i32
    // CHECK: %[[P:.*]] = piko.storage.append
    // CHECK: piko.store %[[X]], checked @out
    %x = piko.get %p "x" : !piko.prim<@F> -> i32
    piko.store %x, checked @out[%c0 : index] "x" : i32
    // Arrays are row-major.
    // CHECK: piko.store %[[W10]], checked @out
    %w10 = piko.get %p "w"[%c1, %c0] : !piko.prim<@F> -> i32
    piko.store %w10, checked @out[%c1 : index] "x" : i32
    // An index that is not known, or outside the array, is left as it is.
    // CHECK: piko.get %[[P]] "w"
    // CHECK: piko.get %[[P]] "w"
    %unknown = piko.get %p "w"[%n, %c0] : !piko.prim<@F> -> i32
    piko.store %unknown, checked @out[%c0 : index] "x" : i32
    %outside = piko.get %p "w"[%c2, %c0] : !piko.prim<@F> -> i32
    piko.store %outside, checked @out[%c1 : index] "x" : i32
  }
}

// Reads, queries of bins and constants that nobody uses go away.
// CHECK-LABEL: piko.pipeline @Unused
piko.pipeline @Unused rank 2 {
  piko.constant @c : @F
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // CHECK: ^bb0(
    // CHECK-NEXT: }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x, %x : i32, i32
      %lo = piko.bin_lo %b[0]
      %d = piko.domain[0]
      %v = piko.load @c "x" : i32
      piko.return
    }
  }
}
