// RUN: piko-opt --piko-form-gbuffer %s 2>/dev/null | FileCheck %s
//
// Names that are taken, and a number of a width that no field has.

// CHECK: piko.record @piko.overwritten
// CHECK: piko.record @piko.kept0 {"kept" : i8 at 0} size 1 align 1
func.func private @piko.kept()
piko.record @F {"x" : i32 at 0, "a" : f32 at 4, "b" : f32 at 8} size 12 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @color : @D rank 1
  // CHECK: piko.image @color.kept1 : @piko.kept0 rank 1 internal
  piko.image @color.kept : @D rank 1
  piko.source @last
  piko.source @last_pixels
  piko.stage @last bins [0] threads 1 lineage 7 ordered : @F -> [] {}
  piko.stage @last_pixels bins [0] threads 1 lineage 3 : @F -> [] {}
  // CHECK: piko.stage @last_pixels1 bins [1024] threads 64 lineage 8
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    %turns = arith.constant 12 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %b = piko.get %f "b" : !piko.prim<@F> -> f32
        %n = arith.fptosi %a : f32 to i4
        %m = arith.fptosi %b : f32 to i4
        %o = arith.xori %n, %m : i4
        // CHECK: arith.extui %{{.*}} : i4 to i8
        %sum = scf.for %i = %zero to %turns step %one iter_args(%before = %o) -> i4 {
          %p = arith.muli %before, %o : i4
          %q = arith.addi %p, %o : i4
          %r = arith.xori %q, %before : i4
          %s = arith.muli %r, %p : i4
          %t = arith.addi %s, %q : i4
          %u = arith.xori %t, %r : i4
          %v = arith.muli %u, %t : i4
          %after = arith.subi %v, %u : i4
          scf.yield %after : i4
        }
        %sum32 = arith.sitofp %sum : i4 to f32
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum32 : f32]
        } {piko.inside}
      }
    }
  }
  // CHECK-LABEL: piko.kernel @kernel_last_pixels1
  // CHECK: arith.trunci %{{.*}} : i8 to i4
  piko.kernel @kernel_last_pixels {
    piko.bins of @last_pixels {
    ^bb0(%bin: index):
      piko.items of @last_pixels {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
  piko.program {
    piko.clear @color, @color.kept
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @last(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
    %2 = piko.feed 1 : !piko.edge<@F>
    %3 = piko.join @last_pixels(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last_pixels(%3) : (!piko.bins<@F>) -> ()
  }
}
