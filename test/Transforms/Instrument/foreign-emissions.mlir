// RUN: piko-test-opt %s | FileCheck %s --check-prefix=PARSE
// RUN: piko-test-opt %s --piko-synthesize | FileCheck %s --check-prefix=KERNELS
// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine | FileCheck %s --check-prefix=MACHINE
// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-cpu | FileCheck %s --check-prefix=CPU
// RUN: piko-test-opt %s --piko-add-checks --piko-synthesize --piko-to-machine --piko-to-cpu | FileCheck %s --check-prefix=CHECKED
// RUN: piko-test-opt %s --piko-synthesize --piko-to-machine --piko-to-gpu | FileCheck %s --check-prefix=GPU

// An emission of another dialect goes through every pass by what its interface
// says of it; one that a pass changes becomes a piko.emit.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"x" : i32 at 0, "y" : i32 at 4, "z" : i32 at 8} size 12 align 4

// PARSE: piko_test.emit_same 1 %{{.*}} times 3

// Nothing depends on @never, whose port goes, and with it the number of the other
// one; of what goes to @keep, "y" is not needed; @inside becomes a part of @a.
// KERNELS-LABEL: piko.pipeline @P
// KERNELS-NOT:     piko.stage @never
// KERNELS:         piko.stage @a {{.*}} fused ["inside"] : @F -> [@G.keep]
// KERNELS:         piko.process of @a
// KERNELS:           %[[X:.*]] = piko.get %{{.*}} "x"
// KERNELS-NOT:       piko_test
// KERNELS:           piko.update of "inside" @seen
// KERNELS:           piko.emit 0(%[[X]], %[[X]]) : i32, i32
// MACHINE-LABEL: piko.pipeline @P
// MACHINE:         piko.kernel @kernel_a
// MACHINE:           piko.emit 0(%[[X:.*]], %[[X]]) : i32, i32
// CPU-LABEL:     func.func private @P.kernel_a
// CPU:             llvm.call @pikoir_append
// CHECKED-LABEL: func.func private @P.kernel_a
// CHECKED-COUNT-3: llvm.call @pikoir_check_emit
// GPU-LABEL:     gpu.func @P_kernel_a
// GPU-NOT:         piko_test
piko.pipeline @P rank 1 {
  piko.image @seen : @F rank 1
  piko.buffer @sums : @F
  piko.source @a
  piko.edge @a[0] -> @never
  piko.edge @a[1] -> @keep
  piko.edge @a[2] -> @inside
  piko.stage @a bins [8] threads 1 : @F -> [@G, @G, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko_test.emit_same 0 %x times 3
      piko_test.emit_same 2 %x times 1
      piko_test.emit_same 1 %x times 3
      piko.return
    }
  }
  piko.stage @never bins [0] threads 1 : @G -> [] {
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      piko.return
    }
  }
  piko.stage @inside bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen[%x : i32] {
      ^bb0(%old: i32):
        %sum = arith.addi %old, %x : i32
        piko.yield [%sum : i32]
      }
      piko.return
    }
  }
  piko.stage @keep bins [0] threads 1 : @G -> [] {
    piko.process {
    ^bb0(%g: !piko.prim<@G>):
      %x = piko.get %g "x" : !piko.prim<@G> -> i32
      %z = piko.get %g "z" : !piko.prim<@G> -> i32
      %at = arith.constant 0 : index
      piko.atomic add @sums[%at : index] "x", %x : i32
      piko.atomic max_signed @sums[%at : index] "x", %z : i32
      piko.return
    }
  }
}
