// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-split-loops{lockstep=16},piko-lockstep,piko-plan-vectors{lanes=8},piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

// As many iterations as some processor has lanes run in lockstep on all of them:
// a vote is a reduction of a mask; what lanes agree on, and an array of it, stays
// scalar; an array in which they differ has columns.
piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Votes
// CHECK-NOT:     piko.cpu.scratch
// CHECK-DAG:     %[[OWN:.*]] = memref.alloca() {alignment = 64 : i64} : memref<32xf32>
// CHECK-DAG:     %[[STACK:.*]] = memref.alloca() : memref<4xi32>
// CHECK:         memref.store %{{.*}}, %[[STACK]]
// CHECK:         scf.while (%[[TOP:.*]] = %{{.*}}, %{{.*}} = %{{.*}}) : (i32, vector<16xf32>)
// CHECK:           scf.condition
// CHECK:           memref.load %[[STACK]]
// CHECK:           vector.store %{{.*}}, %[[OWN]]
// CHECK:           %[[SOME:.*]] = arith.cmpf olt, %{{.*}} : vector<16xf32>
// CHECK:           %[[ANY:.*]] = vector.reduction <or>, %[[SOME]] : vector<16xi1> into i1
// CHECK:           scf.if %[[ANY]]
// CHECK:             memref.store %{{.*}}, %[[STACK]]
piko.pipeline @Votes rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c16 = arith.constant 16 : index
    %c5 = arith.constant 5 : index
    %one = arith.constant 1 : i32
    %zero = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // expected-remark@+1 {{these iterations are vectorized for 16 at once}}
      piko.parallel_for %c16 {
      ^bb0(%i: index):
        %stack = memref.alloca() : memref<4xi32>
        %own = memref.alloca() : memref<2xf32>
        %word = arith.index_cast %i : index to i32
        %f = arith.sitofp %word : i32 to f32
        memref.store %one, %stack[%c0] : memref<4xi32>
        %end:2 = scf.while (%top = %one, %v = %f) : (i32, f32) -> (i32, f32) {
          %goes = arith.cmpi sgt, %top, %zero : i32
          scf.condition(%goes) %top, %v : i32, f32
        } do {
        ^bb0(%top: i32, %v: f32):
          %less = arith.subi %top, %one : i32
          %at = arith.index_cast %less : i32 to index
          %entry = memref.load %stack[%at] : memref<4xi32>
          memref.store %v, %own[%c1] : memref<2xf32>
          %z = piko.load checked @in[%entry : i32] "z" : f32
          %some = arith.cmpf olt, %v, %z : f32
          %any = piko.reduce %some : i1 {
          ^bb0(%a: i1, %b: i1):
            %c = arith.ori %a, %b : i1
            piko.yield results [%c : i1]
          }
          %next = scf.if %any -> (i32) {
            %further = arith.addi %entry, %one : i32
            memref.store %further, %stack[%at] : memref<4xi32>
            scf.yield %top : i32
          } else {
            scf.yield %less : i32
          }
          %sum = arith.addf %v, %z : f32
          scf.yield %next, %sum : i32, f32
        }
        %kept = memref.load %own[%c1] : memref<2xf32>
        %all = arith.addf %kept, %end#1 : f32
        // expected-note@+1 {{lanes write a field of 'out' one after the other, by a scatter}}
        piko.store %all, checked @out[%i : index] "z" : f32
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// Five values, combined as a tree: where there is no other one, a value stays.
piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Tree
// CHECK:         %[[V:.*]] = piko.cpu.gather consecutive @in
// CHECK:         %[[V1:.*]] = vector.shuffle %[[V]], %[[V]] [1, 2, 3, 4, 4, 5, 6, 7]
// CHECK:         %[[S1:.*]] = arith.addf %[[V]], %[[V1]] : vector<8xf32>
// CHECK:         %[[T1:.*]] = arith.select %{{.*}}, %[[S1]], %[[V]]
// CHECK:         %[[V2:.*]] = vector.shuffle %[[T1]], %[[T1]] [2, 3, 4, 3, 4, 5, 6, 7]
// CHECK:         %[[S2:.*]] = arith.addf %[[T1]], %[[V2]]
// CHECK:         %[[T2:.*]] = arith.select %{{.*}}, %[[S2]], %[[T1]]
// CHECK:         %[[V4:.*]] = vector.shuffle %[[T2]], %[[T2]] [4, 1, 2, 3, 4, 5, 6, 7]
// CHECK:         %[[S4:.*]] = arith.addf %[[T2]], %[[V4]]
// CHECK:         vector.extract %{{.*}}[0] : f32 from vector<8xf32>
piko.pipeline @Tree rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c16 = arith.constant 16 : index
    %c5 = arith.constant 5 : index
    %one = arith.constant 1 : i32
    %zero = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // expected-remark@+1 {{these iterations are vectorized for 8 at once}}
      piko.parallel_for %c5 {
      ^bb0(%i: index):
        // expected-note@+1 {{lanes read a field of 'in' one after the other, by a gather}}
        %v = piko.load checked @in[%i : index] "z" : f32
        %w2 = arith.mulf %v, %v : f32
        %sum = piko.reduce %v : f32 {
        ^bb0(%a: f32, %b: f32):
          %c = arith.addf %a, %b : f32
          piko.yield results [%c : f32]
        }
        %part = arith.divf %w2, %sum : f32
        // expected-note@+1 {{lanes write a field of 'out' one after the other, by a scatter}}
        piko.store %part, checked @out[%i : index] "z" : f32
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// What is emitted before a barrier comes in the order of iterations: the
// loop is cut, and emits what was kept.
piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         piko.cpu.scratch
// CHECK-NOT:     vector.reduction
piko.pipeline @Emits rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c16 = arith.constant 16 : index
    %c5 = arith.constant 5 : index
    %one = arith.constant 1 : i32
    %zero = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // expected-remark@+1 {{these iterations are not vectorized: it keeps the order of iterations, and a barrier follows}}
      piko.parallel_for %c16 {
      ^bb0(%i: index):
        %v = piko.load checked @in[%i : index] "z" : f32
        %n0 = piko.load checked @in[%i : index] "n" : i32
        // expected-note@+1 {{here}}
        %p = piko.storage.append %w[0] (%v, %n0) : f32, i32 -> !piko.prim<@F>
        %sum = piko.reduce %n0 : i32 {
        ^bb0(%a: i32, %b: i32):
          %c = arith.addi %a, %b : i32
          piko.yield results [%c : i32]
        }
        %q = piko.storage.append %w[0] (%v, %sum) : f32, i32 -> !piko.prim<@F>
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// So it is where iterations may part ways before one.
piko.record @F {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
// CHECK-LABEL: piko.pipeline @Parts
// CHECK:         piko.cpu.scratch
// CHECK:         piko.fail_barrier
piko.pipeline @Parts rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c16 = arith.constant 16 : index
    %c5 = arith.constant 5 : index
    %one = arith.constant 1 : i32
    %zero = arith.constant 0 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      // expected-remark@+3 {{these iterations are not vectorized: iterations may not go to a barrier together}}
      // expected-remark@+2 {{these iterations are vectorized for 8 at once}}
      // expected-remark-re@+1 {{8 at once are expected to take {{2[0-9]}} cycles, and one after the other}}
      piko.parallel_for %c16 {
      ^bb0(%i: index):
        // expected-note@+1 {{lanes read a field of 'in' one after the other, by a gather}}
        %n0 = piko.load checked @in[%i : index] "n" : i32
        %some = arith.cmpi sgt, %n0, %zero : i32
        // expected-note@+1 {{here}}
        scf.if %some {
          piko.sync
        }
        %f = arith.sitofp %n0 : i32 to f32
        %g = arith.mulf %f, %f : f32
        // expected-note@+1 {{lanes access elements in different places}}
        piko.store %g, checked @out[%i : index] "z" : f32
        piko.yield
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
