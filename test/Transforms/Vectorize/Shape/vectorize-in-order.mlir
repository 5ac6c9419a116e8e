// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

// A loop of a phase that counts up to a number that is not its own, and stores
// each field at most once in an iteration: lanes share its turns.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @InOrder
// CHECK:         scf.for %{{.*}} = %c0 to %{{.*}} step %c16
// CHECK:           piko.cpu.gather consecutive @in
// CHECK:           math.sqrt %{{.*}} : vector<16xf32>
// CHECK:           piko.cpu.scatter %{{.*}}, consecutive @out
piko.pipeline @InOrder rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : i64
    %one = arith.constant 1 : i64
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    %m = arith.index_cast %n : index to i64
    scf.forall (%u) in (%n) {
      // expected-remark@+1 {{iterations of this loop do not depend on one another, and are vectorized for 16 at once}}
      %end = scf.while (%i = %zero) : (i64) -> i64 {
        %goes = arith.cmpi ne, %i, %m : i64
        scf.condition(%goes) %i : i64
      } do {
      ^bb0(%i: i64):
        %x = arith.index_cast %i : i64 to index
        %v = piko.load checked @in[%x : index] "z" : f32
        %w = arith.mulf %v, %two : f32
        %r = math.sqrt %w : f32
        %f = arith.sitofp %i : i64 to f32
        %q = arith.divf %r, %f : f32
        %positive = arith.cmpf ogt, %q, %two : f32
        scf.if %positive {
          %s = arith.divf %q, %v : f32
          piko.store %s, checked @out[%x : index] "z" : f32
        }
        %next = arith.addi %i, %one : i64
        scf.yield %next : i64
      }
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

// What reads the state that it changes, or stores a field in two places, where
// two lanes could change their order, stays as it is.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Refused
// CHECK-NOT:     vector<16
piko.pipeline @Refused rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @out[%x : index] "z" : f32
        %w = arith.divf %v, %two : f32
        %r = math.sqrt %w : f32
        %next = arith.addi %x, %c1 : index
        piko.store %r, checked @out[%next : index] "z" : f32
      }
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %w = arith.divf %v, %two : f32
        %r = math.sqrt %w : f32
        %next = arith.addi %x, %c1 : index
        piko.store %w, checked @out[%x : index] "z" : f32
        piko.store %r, checked @out[%next : index] "z" : f32
      }
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

// -----

// Turns that do nothing but what stands under a condition, with a loop of its
// own: those that have something to do are found first.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Compacted
// CHECK-DAG:     %[[FLAGS:.*]] = memref.alloca() : memref<1024xi8>
// CHECK-DAG:     %[[PLACES:.*]] = memref.alloca() : memref<1024xi32>
// CHECK:         scf.for %[[FIRST:.*]] = %c0 to %{{.*}} step %c1024
// CHECK:           %[[COUNT:.*]] = scf.for %[[AT:.*]] = %c0 to %{{.*}} step %c1 iter_args(%[[KNOWN:.*]] = %c0)
// CHECK:             memref.store %{{.*}}, %[[PLACES]][%[[KNOWN]]]
// CHECK:             %[[FLAG:.*]] = memref.load %[[FLAGS]][%[[AT]]]
// CHECK:             %[[ONE:.*]] = arith.index_castui %[[FLAG]] : i8 to index
// CHECK:             arith.addi %[[KNOWN]], %[[ONE]]
// CHECK:           scf.for %[[TURN:.*]] = %c0 to %[[COUNT]] step %c16
// CHECK:             vector.maskedload %[[PLACES]][%[[TURN]]]
// CHECK:             scf.for
// CHECK:               math.sqrt %{{.*}} : vector<16xf32>
// CHECK:             piko.cpu.scatter
piko.pipeline @Compacted rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %two = arith.constant 2.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      // expected-remark@+1 {{iterations of this loop do not depend on one another, and are vectorized for 16 at once, of those that have something to do}}
      scf.for %x = %c0 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : f32
        %some = arith.cmpf ogt, %v, %two : f32
        scf.if %some {
          %sum = scf.for %y = %c0 to %n step %c1 iter_args(%s = %zero) -> f32 {
            %w = piko.load checked @in[%y : index] "z" : f32
            %d = arith.subf %w, %v : f32
            %r = math.sqrt %d : f32
            %t = arith.addf %s, %r : f32
            scf.yield %t : f32
          }
          piko.store %sum, checked @out[%x : index] "z" : f32
        }
      }
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
