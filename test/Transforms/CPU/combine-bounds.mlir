// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-combine-bounds))' --split-input-file %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-combine-bounds{max-tests=1}))' --split-input-file %s | FileCheck %s --check-prefix=ONE

piko.record @Number {"value" : i32 at 0} size 4 align 4

// Two chains of two look-ups: the first ones share a test, and the second ones, as
// these need what the first ones read. Arithmetic that an index needs moves along.
// Where a test fails, each has its own.
// CHECK-LABEL: piko.kernel @chains
// CHECK:         scf.for %[[I:.*]] = %{{.*}} to
// CHECK:           %[[J:.*]] = arith.addi %[[I]], %{{.*}}
// CHECK:           %[[J_IN:.*]] = arith.cmpi ult, %[[J]], %[[SIZE:.*]]
// CHECK:           %[[LARGEST:.*]] = arith.maxui %[[I]], %[[J]] : index
// CHECK-NEXT:      %[[IN:.*]] = arith.cmpi ult, %[[LARGEST]], %[[SIZE]]
// CHECK-NEXT:      %[[ALL:.*]] = piko.cpu.vote %[[IN]]
// CHECK-NEXT:      %[[AB:.*]]:2 = scf.if %[[ALL]] -> (i32, i32) {
// CHECK-NEXT:        %[[A:.*]] = piko.load checked @table[%[[I]] : index]
// CHECK-NEXT:        %[[B:.*]] = piko.load checked @table[%[[J]] : index]
// CHECK-NEXT:        scf.yield %[[A]], %[[B]]
// CHECK-NEXT:      } else {
// CHECK-NEXT:        %[[A2:.*]] = scf.if %{{.*}} -> (i32) {
// CHECK:             } else {
// CHECK-NEXT:          piko.fail @a in %{{.*}} outside @table(%[[I]])
// CHECK:             %[[B2:.*]] = scf.if %[[J_IN]] -> (i32) {
// CHECK:             } else {
// CHECK-NEXT:          piko.fail @a in %{{.*}} outside @table(%[[J]])
// CHECK:             scf.yield %[[A2]], %[[B2]]
// CHECK:           } {piko.probability =
// CHECK:           arith.index_cast %[[AB]]#0
// CHECK:           arith.index_cast %[[AB]]#1
// CHECK:           %[[NEXT:.*]] = arith.maxui %[[K:.*]], %[[L:.*]] : i32
// CHECK-NEXT:      %[[WIDE:.*]] = arith.index_cast %[[NEXT]] : i32 to index
// CHECK-NEXT:      %[[BOTH:.*]] = arith.cmpi ult, %[[WIDE]], %[[SIZE]]
// CHECK-NEXT:      %[[VOTE:.*]] = piko.cpu.vote %[[BOTH]]
// CHECK-NEXT:      scf.if %[[VOTE]] -> (i32, i32) {
// CHECK-NOT:       -> (i32, i32)
// ONE-LABEL: piko.kernel @chains
// ONE-NOT:     -> (i32, i32)
// ONE:         %[[VOTE:.*]] = piko.cpu.vote
// ONE-NEXT:    scf.if %[[VOTE]] -> (i32) {
// ONE-NEXT:      piko.load checked @table
piko.pipeline @P rank 1 {
  piko.buffer @table : @Number
  piko.buffer @out : @Number
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Number -> [] {}
  piko.kernel @chains {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %zero = arith.constant 0 : i32
    %n = piko.extent @table[0]
    scf.for %i = %c0 to %c9 step %c1 {
      %i_in = arith.cmpi ult, %i, %n : index
      %a = scf.if %i_in -> (i32) {
        %0 = piko.load checked @table[%i : index] "value" : i32
        scf.yield %0 : i32
      } else {
        piko.fail @a in %c0 outside @table(%i)
        scf.yield %zero : i32
      }
      %k = arith.index_cast %a : i32 to index
      %k_in = arith.cmpi ult, %k, %n : index
      %c = scf.if %k_in -> (i32) {
        %0 = piko.load checked @table[%k : index] "value" : i32
        scf.yield %0 : i32
      } else {
        piko.fail @a in %c0 outside @table(%k)
        scf.yield %zero : i32
      }
      %j = arith.addi %i, %c1 : index
      %j_in = arith.cmpi ult, %j, %n : index
      %b = scf.if %j_in -> (i32) {
        %0 = piko.load checked @table[%j : index] "value" : i32
        scf.yield %0 : i32
      } else {
        piko.fail @a in %c0 outside @table(%j)
        scf.yield %zero : i32
      }
      %l = arith.index_cast %b : i32 to index
      %l_in = arith.cmpi ult, %l, %n : index
      %d = scf.if %l_in -> (i32) {
        %0 = piko.load checked @table[%l : index] "value" : i32
        scf.yield %0 : i32
      } else {
        piko.fail @a in %c0 outside @table(%l)
        scf.yield %zero : i32
      }
      %sum = arith.addi %c, %d : i32
      memref.alloca_scope {
        %m = memref.alloca() : memref<1xi32>
        memref.store %sum, %m[%c0] : memref<1xi32>
      }
    }
  }
}

// -----

piko.record @Number {"value" : i32 at 0} size 4 align 4

// One index, which two sizes limit, of which the least is compared. An index that
// varies with another loop keeps its own test, and so does a read after a store to
// what it reads, and one after a loop.
// CHECK-LABEL: piko.kernel @others
// CHECK:         scf.for %[[J:[a-z0-9]+]] =
// CHECK:           scf.for %[[I:[a-z0-9]+]] =
// CHECK:             %[[MIN:.*]] = arith.minui %{{.*}}, %{{.*}} : index
// CHECK-NEXT:        %[[IN:.*]] = arith.cmpi ult, %[[I]], %[[MIN]]
// CHECK-NEXT:        %[[ALL:.*]] = piko.cpu.vote %[[IN]]
// CHECK-NEXT:        scf.if %[[ALL]] -> (i32, i32) {
// CHECK-NEXT:          piko.load checked @table[%[[I]] : index]
// CHECK-NEXT:          piko.load checked @out[%[[I]] : index]
// CHECK:             } {piko.probability =
// CHECK:             %[[J_VOTE:.*]] = piko.cpu.vote
// CHECK-NEXT:        scf.if %[[J_VOTE]] -> (i32) {
// CHECK-NEXT:          piko.load checked @table[%[[J]] : index]
// CHECK:             piko.store
// CHECK:             %[[OUT_VOTE:.*]] = piko.cpu.vote
// CHECK-NEXT:        scf.if %[[OUT_VOTE]] -> (i32) {
// CHECK-NEXT:          piko.load checked @out[%[[I]] : index]
// CHECK:             scf.for
// CHECK:             %[[I_VOTE:.*]] = piko.cpu.vote
// CHECK-NEXT:        scf.if %[[I_VOTE]] -> (i32) {
// CHECK-NEXT:          piko.load checked @table[%[[I]] : index]
piko.pipeline @P rank 1 {
  piko.buffer @table : @Number
  piko.buffer @out : @Number
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Number -> [] {}
  piko.kernel @others {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c9 = arith.constant 9 : index
    %zero = arith.constant 0 : i32
    %n = piko.extent @table[0]
    %o = piko.extent @out[0]
    scf.for %j = %c0 to %c9 step %c1 {
      scf.for %i = %c0 to %c9 step %c1 {
        %in = arith.cmpi ult, %i, %n : index
        %a = scf.if %in -> (i32) {
          %0 = piko.load checked @table[%i : index] "value" : i32
          scf.yield %0 : i32
        } else {
          piko.fail @a in %c0 outside @table(%i)
          scf.yield %zero : i32
        }
        %j_in = arith.cmpi ult, %j, %n : index
        %b = scf.if %j_in -> (i32) {
          %0 = piko.load checked @table[%j : index] "value" : i32
          scf.yield %0 : i32
        } else {
          piko.fail @a in %c0 outside @table(%j)
          scf.yield %zero : i32
        }
        %out_in = arith.cmpi ult, %i, %o : index
        %c = scf.if %out_in -> (i32) {
          %0 = piko.load checked @out[%i : index] "value" : i32
          scf.yield %0 : i32
        } else {
          piko.fail @a in %c0 outside @out(%i)
          scf.yield %zero : i32
        }
        %sum = arith.addi %a, %b : i32
        piko.store %sum, checked @out[%c0 : index] "value" : i32
        %d = scf.if %out_in -> (i32) {
          %0 = piko.load checked @out[%i : index] "value" : i32
          scf.yield %0 : i32
        } else {
          piko.fail @a in %c0 outside @out(%i)
          scf.yield %zero : i32
        }
        scf.for %k = %c0 to %c9 step %c1 {
          piko.store %c, checked @out[%c0 : index] "value" : i32
        }
        %e = scf.if %in -> (i32) {
          %0 = piko.load checked @table[%i : index] "value" : i32
          scf.yield %0 : i32
        } else {
          piko.fail @a in %c0 outside @table(%i)
          scf.yield %zero : i32
        }
        %more = arith.addi %d, %e : i32
        piko.store %more, checked @out[%c0 : index] "value" : i32
      }
    }
  }
}
