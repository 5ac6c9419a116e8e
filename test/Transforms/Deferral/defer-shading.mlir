// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-defer-shading))' --split-input-file %s 2>/dev/null | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-defer-shading))' --split-input-file --verify-diagnostics -o /dev/null %s

// A loop moves after the work. Two numbers are kept: the sum before the
// loop is cheaper to keep than its parts, and the pixel is known.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4, "b" : f32 at 8} size 12 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @depth : @D rank 1
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  // CHECK-LABEL: piko.kernel @kernel_last
  piko.kernel @kernel_last {
    %none = arith.constant 0.0 : f32
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    // CHECK: ^bb0(%[[BIN:.*]]: index):
    ^bb0(%bin: index):
      // CHECK: %[[LO:.*]] = arith.muli %[[BIN]], %{{.*}} : index
      // CHECK: %[[PAINTED:.*]] = memref.alloca() {alignment = 64 : i64, piko.pixels = "color"} : memref<64xi32>
      // CHECK: %[[SUMS:.*]] = memref.alloca() {alignment = 64 : i64, piko.pixels = "color"} : memref<64xf32>
      // CHECK-NOT: memref.alloca
      // CHECK: scf.for
      // CHECK: memref.store %{{.*}}, %[[PAINTED]]
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
        // CHECK-NOT: piko.update
        // CHECK: memref.store %[[SUM]], %[[SUMS]][%[[AT:.*]]] : memref<64xf32>
        // CHECK: memref.store %{{.*}}, %[[PAINTED]][%[[AT]]] : memref<64xi32>
        scf.if %passed {
          %count = piko.extent @lights[0]
          %twice = arith.addf %both, %both : f32
          %where = arith.sitofp %x : i32 to f32
          %sum = scf.for %i = %zero to %count step %one iter_args(%before = %twice) -> f32 {
            %l = piko.load checked @lights[%i : index] "z" : f32
            %m = arith.mulf %l, %twice : f32
            %n = arith.addf %m, %where : f32
            %o = arith.divf %n, %l : f32
            %after = arith.addf %before, %o : f32
            scf.yield %after : f32
          }
          // expected-remark @below {{what is written to 'color' is computed once for each pixel, when all primitives of the bin are done, from 8 bytes}}
          piko.update @color[%x : i32] in %bin {
          ^bb0(%old: f32):
            piko.yield [%sum : f32]
          } {piko.inside}
        }
      }
      // CHECK: piko.parallel_pixels
      // CHECK: ^bb0(%[[X:.*]]: i32):
      // CHECK: %[[IS:.*]] = memref.load %[[PAINTED]]
      // CHECK: %[[TEST:.*]] = arith.cmpi ne, %[[IS]]
      // CHECK: scf.if %[[TEST]] {
      // CHECK: %[[KEPT:.*]] = memref.load %[[SUMS]]
      // CHECK: %[[TWICE:.*]] = arith.addf %[[KEPT]], %[[KEPT]]
      // CHECK: arith.sitofp %[[X]] : i32 to f32
      // CHECK: %[[RESULT:.*]] = scf.for {{.*}} = %[[TWICE]]
      // CHECK: piko.update @color[%[[X]] : i32] in %[[BIN]] {
      // CHECK: piko.yield[%[[RESULT]] : f32]
    }
  }
}

// -----

// One update that tests and overwrites is two. What is overwritten with reads the depth
// that won, not what the pixel was.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0, "color" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @F
  piko.image @picture : @D rank 1
  piko.source @last
  piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  // CHECK-LABEL: piko.kernel @kernel_last
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      // CHECK: piko.items of @last
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        // CHECK: %[[PASSED:.*]] = piko.update @picture
        // CHECK: ^bb0(%[[Z:.*]]: f32, %[[COLOR:.*]]: f32):
        // CHECK: %[[LESS:.*]] = arith.cmpf olt
        // CHECK: piko.yield[%{{.*}}, %[[COLOR]] : f32, f32] results[%[[LESS]] : i1]
        // CHECK: scf.if %[[PASSED]] {
        // CHECK: memref.store
        // expected-remark @below {{what is written to 'picture' is computed once for each pixel, when all primitives of the bin are done, from 8 bytes}}
        piko.update @picture[%x : i32] in %bin {
        ^bb0(%z: f32, %color: f32):
          %less = arith.cmpf olt, %a, %z : f32
          %new:2 = scf.if %less -> (f32, f32) {
            %count = piko.extent @lights[0]
            %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
              %l = piko.load checked @lights[%i : index] "a" : f32
              %m = arith.mulf %l, %a : f32
              %n = arith.divf %m, %l : f32
              %after = arith.addf %before, %n : f32
              scf.yield %after : f32
            }
            scf.yield %a, %sum : f32, f32
          } else {
            scf.yield %z, %color : f32, f32
          }
          piko.yield [%new#0, %new#1 : f32, f32]
        } {piko.inside}
      }
      // CHECK: piko.parallel_pixels
      // CHECK: %[[SUM:.*]] = scf.for
      // CHECK: piko.update @picture
      // CHECK: ^bb0(%[[Z:.*]]: f32, %{{.*}}: f32):
      // CHECK: piko.yield[%[[Z]], %[[SUM]] : f32, f32]
    }
  }
}
