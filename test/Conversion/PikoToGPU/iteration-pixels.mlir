// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads{threads=32}))' --split-input-file | FileCheck %s
// Which iterations have a pixel of their own: threads share them; of others it is
// those that meet in a pixel that keep their order.

piko.record @F {"x" : i32 at 0} size 4 align 4

// The low bits of a number, and the others; taken from what all iterations have.
// CHECK-LABEL: piko.kernel @kernel_bits
// CHECK:         piko.parallel_for {{.*}}#piko<threads shared>
piko.pipeline @Bits rank 2 {
  piko.image @image : @F rank 2
  piko.source @bits
  piko.stage @bits bins [0, 0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %w = piko.domain[0]
      %one = arith.constant 1 : i32
      %three = arith.constant 3 : index
      %seven = arith.constant 7 : index
      piko.parallel_for %w {
      ^bb0(%i: index):
        %x = arith.andi %i, %seven : index
        %flipped = arith.subi %w, %x : index
        %y = arith.shrui %i, %three : index
        piko.update @image[%flipped, %y : index, index] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// By another divisor in each iteration two numbers may have one quotient and one
// remainder: 2 by 2, and 3 by 3.
// CHECK-LABEL: piko.kernel @kernel_divisors
// CHECK:         piko.parallel_for {{.*}}#piko<threads pieces>
piko.pipeline @Divisors rank 2 {
  piko.image @image : @F rank 2
  piko.source @divisors
  piko.stage @divisors bins [0, 0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %n = piko.domain[0]
      %one = arith.constant 1 : i32
      piko.parallel_for %n {
      ^bb0(%i: index):
        %width = arith.addi %i, %n : index
        %x = arith.remui %i, %width : index
        %y = arith.divui %i, %width : index
        piko.update @image[%x, %y : index, index] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

// A signed quotient and low bits do not belong together: of -1 and 7 they would be
// alike.
// CHECK-LABEL: piko.kernel @kernel_mixed
// CHECK:         piko.parallel_for {{.*}}#piko<threads pieces>
piko.pipeline @Mixed rank 2 {
  piko.image @image : @F rank 2
  piko.source @mixed
  piko.stage @mixed bins [0, 0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %n = piko.domain[0]
      %one = arith.constant 1 : i32
      %eight = arith.constant 8 : index
      %seven = arith.constant 7 : index
      piko.parallel_for %n {
      ^bb0(%i: index):
        %x = arith.andi %i, %seven : index
        %y = arith.divsi %i, %eight : index
        piko.update @image[%x, %y : index, index] {
        ^bb0(%old: i32):
          %new = arith.addi %old, %one : i32
          piko.yield [%new : i32]
        }
        piko.yield
      }
      piko.return
    }
  }
}
