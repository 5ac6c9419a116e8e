// RUN: piko-opt --piko-form-gbuffer --split-input-file --verify-diagnostics %s | FileCheck %s
// RUN: not piko-opt --piko-form-gbuffer=budget=-1 --split-input-file %s 2>&1 | FileCheck %s --check-prefix=BUDGET
// BUDGET: error: expected a budget of at least 0 bytes, but got -1
// RUN: piko-opt --piko-form-gbuffer=budget=4 --split-input-file %S/form-gbuffer.mlir 2>&1 | FileCheck %s --check-prefix=BYTES
// BYTES: note: what is kept of a pixel may have 4 bytes, but this has 8; give the stage bins of a size
//
// Shading that stays where it is.
// CHECK-NOT: _pixels

// A read that may fail, of which an error must be that of a primitive.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
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
        %sum = scf.for %i = %zero to %turns step %one iter_args(%before = %a) -> f32 {
          // expected-note @below {{the index of this read is not proved to be inside, and would not be tested where it is overwritten; compare it with the size in front}}
          %l = piko.load @lights[%i : index] "z" : f32
          %o = arith.divf %before, %l : f32
          %p = arith.addf %o, %a : f32
          %after = arith.divf %p, %o : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
  piko.program {
    piko.clear @color
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @last(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
  }
}

// -----

// A pixel that may be outside.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
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
        %sum = scf.for %i = %zero to %turns step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %o = arith.divf %before, %l : f32
          %p = arith.addf %o, %a : f32
          %after = arith.divf %p, %o : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        // expected-note @below {{this pixel is not proved to be in the bin; take one of parallelForPixels}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        }
      }
    }
  }
  piko.program {
    piko.clear @color
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @last(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
  }
}

// -----

// What was there counts.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
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
        %sum = scf.for %i = %zero to %turns step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %o = arith.divf %before, %l : f32
          %p = arith.addf %o, %a : f32
          %after = arith.divf %p, %o : f32
          scf.yield %after : f32
        }
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          %both = arith.addf %old, %sum : f32
          piko.yield [%both : f32]
        } {piko.inside}
      }
    }
  }
  piko.program {
    piko.clear @color
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @last(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
  }
}
