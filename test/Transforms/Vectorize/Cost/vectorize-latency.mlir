// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' --split-input-file --verify-diagnostics %s | FileCheck %s

piko.record @P {"x" : f32 at 0, "index" : i32 at 4} size 8 align 4
piko.record @V {"z" : f32 at 0} size 4 align 4

// An iteration is a chain of products and sums that begins with what the iteration before
// hands on. A second vector takes its turn while the first one waits.
// CHECK-LABEL: piko.pipeline @Chain
// CHECK:         scf.for %{{.*}} = %c0 to %c40
// CHECK-SAME:      vector<32xf32>
piko.pipeline @Chain rank 1 {
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %one = arith.constant 1.0 : f32
    %c0 = arith.constant 0 : index
    %c40 = arith.constant 40 : index
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %n = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@P>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %c = piko.get %p "x" : !piko.prim<@P> -> f32
        %index = piko.get %p "index" : !piko.prim<@P> -> i32
        %end = scf.for %k = %c0 to %c40 step %step iter_args(%z = %c) -> f32 {
          %square = arith.mulf %z, %z : f32
          %more = arith.addf %square, %c : f32
          %next = arith.addf %more, %one : f32
          scf.yield %next : f32
        }
        // expected-note@+1 {{lanes write 'out' in different places, by a scatter}}
        piko.store %end, checked @out[%index : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}

// -----

piko.record @P {"x" : f32 at 0, "index" : i32 at 4} size 8 align 4
piko.record @V {"z" : f32 at 0} size 4 align 4

// What an iteration computes takes longer than the sum that it hands on: one vector.
// CHECK-LABEL: piko.pipeline @Sum
// CHECK-NOT:     vector<32xf32>
piko.pipeline @Sum rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0.0 : f32
    %c0 = arith.constant 0 : index
    %c40 = arith.constant 40 : index
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %n = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@P>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %x = piko.get %p "x" : !piko.prim<@P> -> f32
        %index = piko.get %p "index" : !piko.prim<@P> -> i32
        %end = scf.for %k = %c0 to %c40 step %step iter_args(%s = %zero) -> f32 {
          %y = piko.load checked @in[%k : index] "z" : f32
          %d = arith.subf %x, %y : f32
          %root = math.sqrt %d : f32
          %part = arith.divf %root, %y : f32
          %next = arith.addf %s, %part : f32
          scf.yield %next : f32
        }
        piko.store %end, checked @out[%index : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
