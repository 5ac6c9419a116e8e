// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-vectorize),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-vectorize),canonicalize,cse,piko.pipeline(piko-pair-gathers))' %s | FileCheck %s --check-prefix=PAIR

piko.record @P {"k" : i32 at 0} size 4 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Lanes vote: where the condition holds in all that are at work, and there are some,
// all read by the mask of the loop alone, which waits for no test; and two elements
// side by side are one run, without a further test. Otherwise each has its condition.
// CHECK-LABEL: piko.pipeline @Votes
// CHECK:         %[[WORK:.*]] = arith.cmpi sgt, %{{.*}} {piko.last_lanes} : vector<8xi32>
// CHECK:         %[[IN:.*]] = arith.cmpi ult, %{{.*}} : vector<8x
// CHECK:         %[[NOT:.*]] = arith.xori %[[IN]]
// CHECK:         %[[OUTSIDE:.*]] = arith.select %[[WORK]], %[[NOT]], %{{.*}} : vector<8xi1>, vector<8xi1>
// CHECK-NEXT:    %[[NO:.*]] = vector.reduction <or>, %[[OUTSIDE]]
// CHECK-NEXT:    %[[ALL:.*]] = arith.cmpi eq, %[[NO]], %{{.*}} : i1
// CHECK-NEXT:    %[[SOME:.*]] = vector.reduction <or>, %[[WORK]]
// CHECK-NEXT:    %[[VOTE:.*]] = arith.andi %[[SOME]], %[[ALL]]
// CHECK-NEXT:    %{{.*}}:2 = scf.if %[[VOTE]]
// CHECK:           piko.cpu.gather @in{{.*}} mask %[[WORK]]
// CHECK:           piko.cpu.gather @in{{.*}} mask %[[WORK]]
// CHECK:         } else {
// CHECK:           %[[EACH:.*]] = arith.select %[[WORK]], %[[IN]]
// CHECK:             piko.cpu.gather @in{{.*}} mask %[[EACH]]
// PAIR:          scf.if
// PAIR-NOT:        scf.if
// PAIR:            piko.cpu.gather_run @in
// PAIR-NEXT:       scf.yield
// PAIR-NEXT:     } else {
piko.pipeline @Votes rank 1 {
  piko.buffer @in : @N
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %one = arith.constant 1 : i32
    %zero = arith.constant 0 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    %n = piko.extent @in[0]
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %j = arith.addi %k, %one : i32
        %at = arith.index_cast %j : i32 to index
        %inside = arith.cmpi ult, %at, %n : index
        %all = piko.cpu.vote %inside
        %r:2 = scf.if %all -> (i32, i32) {
          %x = piko.load checked @in[%k : i32] "n" : i32
          %y = piko.load checked @in[%j : i32] "n" : i32
          scf.yield %x, %y : i32, i32
        } else {
          %y = scf.if %inside -> (i32) {
            %z = piko.load checked @in[%j : i32] "n" : i32
            scf.yield %z : i32
          } else {
            scf.yield %zero : i32
          }
          scf.yield %zero, %y : i32, i32
        }
        %sum = arith.addi %r#0, %r#1 : i32
        piko.store %sum, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>, piko.vector_lanes = 8 : i64}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
