// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' %s | FileCheck %s

// Whether an index of 32 bits is inside of a buffer is seen from these: without
// its sign, a negative one is 2^31 or more. Lanes that fail widen their own.
piko.record @V {"z" : f32 at 0} size 4 align 4
piko.record @I {"i" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Tested
// CHECK-DAG:     %[[MOST:.*]] = arith.constant 2147483648 : index
// CHECK:         %[[I:.*]] = piko.cpu.gather consecutive @in
// CHECK-DAG:     %[[PLACES:.*]] = arith.index_cast %[[I]] : vector<16xi32> to vector<16xindex>
// CHECK-DAG:     %[[SIZE:.*]] = piko.extent @table[0]
// CHECK:         %[[LIMIT:.*]] = arith.minui %[[SIZE]], %[[MOST]] : index
// CHECK:         %[[BITS:.*]] = arith.index_cast %[[LIMIT]] : index to i32
// CHECK:         %[[LIMITS:.*]] = vector.broadcast %[[BITS]] : i32 to vector<16xi32>
// CHECK:         arith.cmpi ult, %[[I]], %[[LIMITS]] : vector<16xi32>
// CHECK:         scf.if
// CHECK:           piko.cpu.gather @table[%[[PLACES]] : vector<16xindex>]
// CHECK:         scf.if
// CHECK:           vector.store %[[I]], %[[SLOT:.*]][%c0] : memref<16xi32>
// CHECK:           %[[OWN:.*]] = memref.load %[[SLOT]][%{{.*}}] : memref<16xi32>
// CHECK:           %[[PLACE:.*]] = arith.index_cast %[[OWN]] : i32 to index
// CHECK:           piko.fail @a in %{{.*}} outside @table(%[[PLACE]])
// An index of 64 bits is compared as it is.
// CHECK:         arith.cmpi ult, %{{.*}}, %{{.*}} : vector<16xindex>
piko.pipeline @Tested rank 1 {
  piko.buffer @in : @I
  piko.buffer @table : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c0 to %n step %c1 {
        %i = piko.load checked @in[%x : index] "i" : i32
        %place = arith.index_cast %i : i32 to index
        %size = piko.extent @table[0]
        %isInside = arith.cmpi ult, %place, %size : index
        %v = scf.if %isInside -> (f32) {
          %one = piko.load checked @table[%i : i32] "z" : f32
          scf.yield %one : f32
        } else {
          %bin = piko.storage.bucket_bin %bins[%c0] : !piko.bins<@V>
          piko.fail @a in %bin outside @table(%place)
          scf.yield %zero : f32
        }
        %square = arith.muli %place, %place : index
        %isNear = arith.cmpi ult, %square, %size : index
        %w = arith.mulf %v, %v : f32
        %p = arith.select %isNear, %w, %v : f32
        piko.store %p, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    }
  }
}
