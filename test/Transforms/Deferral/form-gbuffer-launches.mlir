// RUN: piko-opt --piko-form-gbuffer --split-input-file --verify-diagnostics %s | FileCheck %s
//
// Kernels after which nothing can be shaded.
// CHECK-NOT: _pixels

// Another kernel of the strips overwrites, too: what it has overwritten for one strip, the
// next strip's primitives overwrite.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.edge @last[0] -> @more
  piko.stage @last bins [0] threads 1 ordered : @F -> [@F] {}
  piko.stage @more bins [0] threads 1 ordered : @F -> [] {}
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
        piko.emit 0 (%x, %a) : i32, f32
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
  piko.kernel @kernel_more {
    piko.bins of @more {
    ^bb0(%bin: index):
      piko.items of @more {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note @below {{in strips or on a cycle, this runs between one part of the primitives and the next; let the stage wait (endStage)}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          %twice = arith.addf %old, %old : f32
          piko.yield [%twice : f32]
        } {piko.inside}
      }
    }
  }
  piko.program {
    piko.clear @color
    %0 = piko.feed 0 : !piko.edge<@F>
    piko.strips(%0) {
    ^bb0(%strip: !piko.edge<@F>):
      %1 = piko.join @last(concatenate %strip) : (!piko.edge<@F>) -> !piko.bins<@F>
      %2 = piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
      %3 = piko.join @more(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_more(%3) : (!piko.bins<@F>) -> ()
      piko.leave
    } : (!piko.edge<@F>) -> ()
  }
}

// -----

// Without a program.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
  // expected-note @below {{no program launches it once}}
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
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }

}
