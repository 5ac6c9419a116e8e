// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=64},piko-to-grids))' --split-input-file --verify-diagnostics -o /dev/null
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=256},piko-to-grids))' --split-input-file -o /dev/null 2>&1 | FileCheck %s --check-prefix=MANY

// Why threads take the pixels of one primitive after the other.

// Masks of 8 bytes for each of 4096 pixels leave few blocks of 64 threads room, but
// those of 256.
// MANY-NOT: remark: {{.*}}too much memory
piko.record @Row {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @LargeBins rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [64, 64] threads 64 : @Row -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    // expected-remark @below {{the threads of a block take one primitive after the other: masks for the pixels of a bin take too much memory for a block of 64 threads}}
    piko.process {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %to = piko.get %f "to" : !piko.prim<@Row> -> i32
      %one = arith.constant 1 : i32
      scf.for %i = %x to %to step %one : i32 {
        piko.update @image[%i, %y : i32, i32] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
      }
      piko.return
    }
  }
}

// -----

// Neither way of a condition is rare.
piko.record @Row {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @TwoWays rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 64 : @Row -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %to = piko.get %f "to" : !piko.prim<@Row> -> i32
      %one = arith.constant 1 : i32
      %shared = arith.cmpi sgt, %x, %y : i32
      // expected-remark @below {{the threads of a block take one primitive after the other: primitives have pixels on both ways of a condition, and neither is known to be rare by its arrays}}
      scf.if %shared {
        scf.for %i = %x to %to step %one : i32 {
          piko.update @image[%i, %y : i32, i32] {
          ^bb0(%old: i32):
            %new = arith.addi %old, %one : i32
            piko.yield [%new : i32]
          }
        }
      } else {
        scf.for %i = %y to %to step %one : i32 {
          piko.update @image[%i, %y : i32, i32] {
          ^bb0(%old: i32):
            %new = arith.addi %old, %one : i32
            piko.yield [%new : i32]
          }
        }
      }
      piko.return
    }
  }
}

// -----

// Rows that are not a box.
piko.record @Row {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @Spans rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 64 : @Row -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %to = piko.get %f "to" : !piko.prim<@Row> -> i32
      %one = arith.constant 1 : i32
      scf.for %j = %y to %to step %one : i32 {
        // expected-remark @below {{the threads of a block take one primitive after the other: a row's bounds depend on the row}}
        scf.for %i = %j to %to step %one : i32 {
          piko.update @image[%i, %j : i32, i32] {
          ^bb0(%old: i32):
            %new = arith.addi %old, %one : i32
            piko.yield [%new : i32]
          }
        }
      }
      piko.return
    }
  }
}

// -----

// No primitive has fewer pixels than another.
piko.record @Row {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @Same rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 64 : @Row -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %b = piko.bin_at %x, %y : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@Row>):
      %x = piko.get %f "x" : !piko.prim<@Row> -> i32
      %y = piko.get %f "y" : !piko.prim<@Row> -> i32
      %to = piko.get %f "to" : !piko.prim<@Row> -> i32
      %one = arith.constant 1 : i32
      %zero = arith.constant 0 : i32
      %eight = arith.constant 8 : i32
      // expected-remark @below {{the threads of a block take one primitive after the other: all primitives have the same pixels}}
      scf.for %i = %zero to %eight step %one : i32 {
        piko.update @image[%i, %zero : i32, i32] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
      }
      piko.return
    }
  }
}
