// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize),canonicalize,cse)' --split-input-file --verify-diagnostics %s | FileCheck %s

// An index that is limited to the ends of a row is tested for lanes that read
// one element after the other, before what is the same for all is added; what
// is squared is gathered.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Limited
// CHECK:         scf.for %{{.*}} step %c16
// CHECK:           %[[AT:.*]] = arith.maxsi %{{.*}} : vector<16xi32>
// CHECK:           %[[FIRST:.*]] = vector.extract %[[AT]][0]
// CHECK:           %[[SPLAT:.*]] = vector.broadcast %[[FIRST]]
// CHECK:           %[[ROW:.*]] = arith.addi %[[SPLAT]], %{{.*}} : vector<16xi32>
// CHECK:           %[[DIFFER:.*]] = arith.cmpi ne, %[[AT]], %[[ROW]]
// CHECK:           scf.if %{{.*}} -> (vector<16xf32>) {
// CHECK:             piko.cpu.gather @in[%{{.*}} : vector<16xindex>]
// CHECK:           } else {
// CHECK:             piko.cpu.gather consecutive @in[%{{.*}} : index]
// CHECK:           %[[SQUARE:.*]] = arith.muli %[[AT]], %[[AT]]
// CHECK-NOT:       scf.if
// CHECK:           piko.cpu.gather @in[%{{.*}} : vector<16xindex>]
piko.pipeline @Limited rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    %m = arith.index_cast %n : index to i32
    scf.forall (%u) in (%n) {
      %row = arith.index_cast %u : index to i32
      // expected-remark@+1 {{iterations of this loop do not depend on one another, and are vectorized for 16 at once}}
      %end = scf.while (%i = %zero) : (i32) -> i32 {
        %goes = arith.cmpi slt, %i, %m : i32
        scf.condition(%goes) %i : i32
      } do {
      ^bb0(%i: i32):
        %x = arith.index_cast %i : i32 to index
        %before = arith.subi %i, %one : i32
        %limited = arith.maxsi %before, %zero : i32
        %at = arith.addi %limited, %row : i32
        %y = arith.index_cast %at : i32 to index
        %v = piko.load checked @in[%y : index] "z" : f32
        %square = arith.muli %limited, %limited : i32
        %z = arith.index_cast %square : i32 to index
        %w = piko.load checked @in[%z : index] "z" : f32
        %q = arith.divf %v, %w : f32
        %r = math.sqrt %q : f32
        piko.store %r, checked @out[%x : index] "z" : f32
        %next = arith.addi %i, %one : i32
        scf.yield %next : i32
      }
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
