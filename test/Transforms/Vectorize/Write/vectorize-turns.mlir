// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,piko-plan-vectors{turns=true},piko-vectorize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @F {"z" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4

// Lanes take turns in a loop that emits: in its turn, a lane's iterations are
// lanes again, as their number is as large as it may be.
// CHECK-LABEL: piko.pipeline @Turns
// CHECK:         scf.for %{{.*}} step %c16
// CHECK:           scf.while
// CHECK:             math.cttz
// CHECK:             scf.if
// CHECK:               scf.for %{{.*}} step %c16
// CHECK:                 math.sqrt %{{.*}} : vector<16xf32>
// CHECK:                 piko.cpu.append
// CHECK:             } else {
// CHECK:               scf.for %{{.*}} step %c1 {
// CHECK:                 piko.storage.append
piko.pipeline @Turns rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %half = arith.constant 0.5 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %writer = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@F>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@F> -> !piko.prim<@F>
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %k = piko.get %f "k" : !piko.prim<@F> -> i32
        %0 = arith.mulf %z, %z : f32
        %1 = math.sqrt %0 : f32
        %2 = arith.divf %1, %z : f32
        %a3 = math.sqrt %2 : f32
        %a4 = arith.divf %a3, %1 : f32
        %a5 = math.sqrt %a4 : f32
        %a6 = arith.divf %a5, %a3 : f32
        %3 = math.sqrt %a6 : f32
        %4 = arith.divf %3, %1 : f32
        %n1 = arith.index_cast %k : i32 to index
        // expected-remark@+1 {{iterations of this loop do not depend on one another, and are vectorized for 16 at once}}
        scf.for %j = %c0 to %n1 step %c1 {
          %5 = arith.index_cast %j : index to i32
          %6 = arith.sitofp %5 : i32 to f32
          %7 = arith.addf %6, %4 : f32
          %8 = math.sqrt %7 : f32
          %9 = arith.divf %8, %3 : f32
          %10 = math.sqrt %9 : f32
          %11 = arith.divf %10, %8 : f32
          %12 = math.sqrt %11 : f32
          %13 = arith.divf %12, %10 : f32
          %14 = math.sqrt %13 : f32
          %less = arith.cmpf olt, %14, %half : f32
          scf.if %less {
            %p = piko.storage.append %writer[0] (%14, %5) : f32, i32 -> !piko.prim<@G>
            piko.storage.append_bin %writer[0] of @b in %c1
          }
        }
        piko.storage.next %writer
      } {piko.lanes, piko.mapping = #piko<lanes items>}
      piko.cpu.close_writer %writer
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
