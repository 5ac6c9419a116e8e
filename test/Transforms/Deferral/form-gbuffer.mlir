// RUN: piko-opt --piko-form-gbuffer --split-input-file %s 2>/dev/null | FileCheck %s
// RUN: piko-opt --piko-form-gbuffer --split-input-file %s 2>/dev/null | piko-opt --split-input-file | FileCheck %s
// RUN: piko-opt --piko-form-gbuffer --split-input-file --verify-diagnostics -o /dev/null %s

// A loop moves to a kernel of its own. The sum before it is kept, and that
// the pixel has one; which pixel it is is known.

// CHECK: piko.record @piko.overwritten {"overwritten" : i32 at 0} size 4 align 4
// CHECK: piko.record @piko.kept {"kept" : f32 at 0} size 4 align 4
piko.record @F {"x" : i32 at 0, "a" : f32 at 4, "b" : f32 at 8} size 12 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @depth : @D rank 1
  piko.image @color : @D rank 1
  // CHECK: piko.image @color.overwritten : @piko.overwritten rank 1 clear [0 : i32] internal
  // CHECK: piko.image @color.kept : @piko.kept rank 1 internal
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
  // CHECK: piko.stage @last_pixels bins [1024] threads 64 lineage 1 ordered writes : list @F -> [] {
  // CHECK-NEXT: piko.schedule load_balance every_bin resolved
  // CHECK-LABEL: piko.kernel @kernel_last {
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    %half = arith.constant 0.5 : f32
    piko.bins of @last {
    ^bb0(%bin: index):
      // CHECK: piko.items of @last
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %b = piko.get %f "b" : !piko.prim<@F> -> f32
        // CHECK: %[[SUM:.*]] = arith.addf
        %both = arith.addf %a, %b : f32
        // CHECK: %[[PASSED:.*]] = piko.update @depth
        %passed = piko.update @depth[%x : i32] in %bin {
        ^bb0(%old: f32):
          %less = arith.cmpf olt, %a, %old : f32
          %new = arith.select %less, %a, %old : f32
          piko.yield [%new : f32] results [%less : i1]
        } -> i1 {piko.inside}
        // CHECK: scf.if %[[PASSED]] {
        // CHECK-NOT: piko.update @color[
        // CHECK: piko.update @color.kept[%[[AT:.*]] : i32] in
        // CHECK: piko.yield[%[[SUM]] : f32]
        // CHECK: } {piko.inside}
        // CHECK: piko.update @color.overwritten[%[[AT]] : i32] in
        scf.if %passed {
          %count = piko.extent @lights[0]
          %twice = arith.addf %both, %both : f32
          %where = arith.sitofp %x : i32 to f32
          %sum = scf.for %i = %zero to %count step %one iter_args(%before = %twice) -> f32 {
            %l = piko.load checked @lights[%i : index] "z" : f32
            %m = arith.mulf %l, %twice : f32
            %n = arith.addf %m, %where : f32
            %o = arith.divf %n, %l : f32
            %p = arith.mulf %o, %half : f32
            %after = arith.addf %before, %p : f32
            scf.yield %after : f32
          }
          // expected-remark @below {{what is written to 'color' is computed once for each pixel, by a kernel after that of stage 'last', from 8 bytes}}
          piko.update @color[%x : i32] in %bin {
          ^bb0(%old: f32):
            piko.yield [%sum : f32]
          } {piko.inside}
        }
      }
    }
  }
  // CHECK-LABEL: piko.kernel @kernel_last_pixels
  // CHECK: ^bb0(%[[BIN:.*]]: index):
  // CHECK: piko.lists of @last_pixels
  // CHECK: piko.parallel_pixels
  // CHECK: ^bb0(%[[X:.*]]: i32):
  // CHECK: %[[IS:.*]] = piko.load checked @color.overwritten[%[[X]] : i32] "overwritten" {piko.inside} : i32
  // CHECK: %[[TEST:.*]] = arith.cmpi ne, %[[IS]]
  // CHECK: scf.if %[[TEST]] {
  // CHECK: %[[KEPT:.*]] = piko.load checked @color.kept[%[[X]] : i32] "kept" {piko.inside} : f32
  // CHECK: %[[TWICE:.*]] = arith.addf %[[KEPT]], %[[KEPT]]
  // CHECK: arith.sitofp %[[X]] : i32 to f32
  // CHECK: %[[RESULT:.*]] = scf.for {{.*}} = %[[TWICE]]
  // CHECK: piko.update @color[%[[X]] : i32] in %[[BIN]] {
  // CHECK: piko.yield[%[[RESULT]] : f32]
  // CHECK-LABEL: piko.program
  // CHECK: piko.clear @color.overwritten
  // CHECK: piko.launch @kernel_last(
  // CHECK-NEXT: %[[PIXELS:.*]] = piko.join @last_pixels() : () -> !piko.bins<@F>
  // CHECK-NEXT: piko.launch @kernel_last_pixels(%[[PIXELS]])
  piko.program {
    piko.clear @depth, @color
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @last(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
  }
}

// -----

// Strips overwrite one after the other: the rest is done after the last one. A truth
// value that is kept takes a word.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
// CHECK: piko.record @piko.kept {"kept0" : f32 at 0, "kept1" : i32 at 4} size 8 align 4
piko.pipeline @P rank 2 {
  piko.image @depth : @D rank 2
  piko.image @color : @D rank 2
  piko.source @last
  // CHECK: piko.stage @last_pixels bins [32, 32]
  piko.stage @last bins [0, 0] threads 1 ordered : @F -> [] {}
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
        %less = piko.update @depth[%x, %x : i32, i32] in %bin {
        ^bb0(%old: f32):
          %is = arith.cmpf olt, %a, %old : f32
          piko.yield [%a : f32] results [%is : i1]
        } -> i1 {piko.inside}
        // CHECK: arith.extui %{{.*}} : i1 to i32
        // CHECK: piko.update @color.kept
        %sum = scf.for %i = %zero to %turns step %one iter_args(%before = %a) -> f32 {
          %o = arith.divf %before, %a : f32
          %p = arith.addf %o, %a : f32
          %q = arith.divf %p, %o : f32
          %after = arith.select %less, %p, %q : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{from 12 bytes}}
        piko.update @color[%x, %x : i32, i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
  // CHECK-LABEL: piko.kernel @kernel_last_pixels
  // CHECK: arith.trunci %{{.*}} : i32 to i1
  // CHECK-LABEL: piko.program
  // CHECK: piko.clear @color.overwritten
  // CHECK: piko.strips
  // CHECK: piko.launch @kernel_last(
  // CHECK: piko.leave
  // CHECK: piko.join @last_pixels
  piko.program {
    piko.clear @depth, @color
    %0 = piko.feed 0 : !piko.edge<@F>
    piko.strips(%0) {
    ^bb0(%strip: !piko.edge<@F>):
      %1 = piko.join @last(concatenate %strip) : (!piko.edge<@F>) -> !piko.bins<@F>
      piko.launch @kernel_last(%1) : (!piko.bins<@F>) -> ()
      piko.leave
    } : (!piko.edge<@F>) -> ()
  }
}
