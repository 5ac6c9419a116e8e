// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-share-appends{strip=128}),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

// A strip of iterations finds out at once which of them append. The sum of those
// before says where, and the last one how long the list is. Where there may be few,
// there is a loop as well.
piko.record @I {"k" : i32 at 0} size 4 align 4
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Shared
// CHECK:         %[[LIST:.*]] = memref.alloca() : memref<64xf32>
// CHECK:         %[[COUNT:.*]] = memref.alloca() : memref<1xindex>
// CHECK:         %[[LONG:.*]] = arith.cmpi sge, %[[SIZE:.*]], %c64 : index
// CHECK:         scf.if %[[LONG]] {
// CHECK:           scf.for %[[FIRST:.*]] = %c0 to %[[SIZE]] step %c128 {
// CHECK:             %[[KNOWN:.*]] = memref.load %[[COUNT]][%c0]
// CHECK:             piko.parallel_for
// CHECK:               memref.store %c0_i32, %[[FLAG:.*]][%c0]
// CHECK:               scf.if
// CHECK:                 memref.store %c1_i32, %[[FLAG]][%c0]
// CHECK:               %[[BEFORE:.*]] = piko.scan %{{.*}} empty %c0_i32 : i32
// CHECK:               %[[ROOM:.*]] = arith.cmpi slt, %{{.*}}, %c64
// CHECK:               scf.if
// CHECK:                 memref.store %{{.*}}, %[[LIST]][
// CHECK:               scf.if
// CHECK:                 memref.store %{{.*}}, %[[COUNT]][%c0]
// CHECK:         } else {
// CHECK:           scf.for
// CHECK-NOT:         piko.scan
// CHECK:             memref.store %{{.*}}, %[[LIST]][
piko.pipeline @Shared rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [16] threads 64 : list @I -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %most = arith.constant 64 : index
    %two = arith.constant 2.0 : f32
    piko.bins of @s {
    ^bb0(%bin: index):
      piko.lists of @s {
      ^bb0(%items: !piko.list<@I>):
        %list = memref.alloca() : memref<64xf32>
        %n = piko.list_size %items : !piko.list<@I>
        // expected-remark@+1 {{iterations of this loop append in order, by stream compaction, and threads share them}}
        %l = scf.for %x = %c0 to %n step %c1 iter_args(%k = %c0) -> index {
          %v = piko.load checked @in[%x : index] "z" : f32
          %is_in = arith.cmpf olt, %v, %two : f32
          %more = scf.if %is_in -> index {
            %has_room = arith.cmpi slt, %k, %most : index
            %next = scf.if %has_room -> index {
              memref.store %v, %list[%k] : memref<64xf32>
              %sum = arith.addi %k, %c1 : index
              scf.yield %sum : index
            } else {
              scf.yield %k : index
            }
            scf.yield %next : index
          } else {
            scf.yield %k : index
          }
          scf.yield %more : index
        }
        %last = memref.load %list[%l] : memref<64xf32>
        piko.store %last, checked @out[%bin : index] "z" : f32
      }
    }
  }
}

// -----

// What emits, changes state, is short, or belongs to a primitive stays as it is, and
// so does what reads its list.
piko.record @I {"k" : i32 at 0} size 4 align 4
piko.record @F {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Refused
// CHECK-NOT:     piko.scan
piko.pipeline @Refused rank 1 {
  piko.buffer @in : @F
  piko.buffer @out : @F
  piko.source @s
  piko.source @t
  piko.stage @s bins [16] threads 64 : list @I -> [] {}
  piko.stage @t bins [16] threads 64 : @I -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c63 = arith.constant 63 : index
    %two = arith.constant 2.0 : f32
    piko.bins of @s {
    ^bb0(%bin: index):
      piko.lists of @s {
      ^bb0(%items: !piko.list<@I>):
        %list = memref.alloca() : memref<64xf32>
        %n = piko.list_size %items : !piko.list<@I>
        %stores = scf.for %x = %c0 to %n step %c1 iter_args(%k = %c0) -> index {
          piko.store %two, checked @out[%x : index] "z" : f32
          memref.store %two, %list[%k] : memref<64xf32>
          %sum = arith.addi %k, %c1 : index
          scf.yield %sum : index
        }
        %short = scf.for %x = %c0 to %c63 step %c1 iter_args(%k = %stores) -> index {
          memref.store %two, %list[%k] : memref<64xf32>
          %sum = arith.addi %k, %c1 : index
          scf.yield %sum : index
        }
        // expected-remark@+1 {{this loop appends one element after the other}}
        %reads = scf.for %x = %c0 to %n step %c1 iter_args(%k = %short) -> index {
          // expected-note@+1 {{here a list, or its length, is used for something else}}
          %v = memref.load %list[%c0] : memref<64xf32>
          memref.store %v, %list[%k] : memref<64xf32>
          %sum = arith.addi %k, %c1 : index
          scf.yield %sum : index
        }
        %last = memref.load %list[%reads] : memref<64xf32>
        piko.store %last, checked @out[%bin : index] "z" : f32
      }
    }
  }
  piko.kernel @l {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c100 = arith.constant 100 : index
    %two = arith.constant 2.0 : f32
    piko.bins of @t {
    ^bb0(%bin: index):
      piko.items of @t {
      ^bb0(%item: !piko.prim<@I>):
        %list = memref.alloca() : memref<100xf32>
        %l = scf.for %x = %c0 to %c100 step %c1 iter_args(%k = %c0) -> index {
          memref.store %two, %list[%k] : memref<100xf32>
          %sum = arith.addi %k, %c1 : index
          scf.yield %sum : index
        }
        %last = memref.load %list[%l] : memref<100xf32>
        piko.store %last, checked @out[%bin : index] "z" : f32
      }
    }
  }
}
