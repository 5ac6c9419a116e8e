// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-vectorize),canonicalize,cse)' %s | FileCheck %s

piko.record @P {"k" : i32 at 0} size 4 align 4
piko.record @N {"n" : i32 at 0} size 4 align 4

// Of two elections by all lanes, those of the second are not among those of the first:
// others keep what they had.
// CHECK-LABEL: piko.pipeline @Apart
// CHECK-COUNT-4: math.ctpop
// CHECK:         %[[INNER:.*]] = arith.select %{{.*}} : vector<8xi1>, vector<8xi32>
// CHECK-NEXT:    arith.select %{{.*}}, %[[INNER]], %{{.*}} : vector<8xi1>, vector<8xi32>
// CHECK:         piko.cpu.scatter
piko.pipeline @Apart rank 1 {
  piko.buffer @out : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 : @P -> [] {}
  piko.kernel @k {
    %c3 = arith.constant 3 : i32
    %c5 = arith.constant 5 : i32
    %step = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@P>
    %u = piko.storage.unit_count %bins : !piko.bins<@P>
    scf.forall (%unit) in (%u) {
      %lo, %hi = piko.storage.bucket_range %bins[%unit, %unit] : !piko.bins<@P>
      scf.for %i = %lo to %hi step %step {
        %p = piko.storage.item %bins[%i] : !piko.bins<@P> -> !piko.prim<@P>
        %k = piko.get %p "k" : !piko.prim<@P> -> i32
        %m = arith.muli %k, %c5 : i32
        %a = arith.cmpi sgt, %k, %c3 : i32
        %b = arith.cmpi slt, %k, %c5 : i32
        %side1, %takes1 = piko.cpu.elect %a second 3
        %side2, %takes2 = piko.cpu.elect %b second 3
        %r = scf.if %takes1 -> (i32) {
          %q = scf.if %takes2 -> (i32) {
            scf.yield %m : i32
          } else {
            scf.yield %k : i32
          }
          scf.yield %q : i32
        } else {
          scf.yield %k : i32
        }
        piko.store %r, checked @out[%k : i32] "n" : i32
      } {piko.lanes, piko.mapping = #piko<lanes items>, piko.vector_lanes = 8 : i64}
    }
    piko.storage.close_bins %bins : !piko.bins<@P>
  }
}
