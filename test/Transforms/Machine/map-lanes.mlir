// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-map-lanes))' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-map-lanes))' -mlir-print-op-on-diagnostic=false %s -o /dev/null 2>&1 | FileCheck %s --check-prefix=REMARK

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// Without a parallel loop a lane has a primitive; so it has at a source.
// CHECK-LABEL: piko.pipeline @Items
// REMARK: remark: stage 'a': lanes are given items, because there is no parallel loop
piko.pipeline @Items rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @source_0_a {
    // CHECK: piko.items of @a source 0 lanes items {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      %bin = arith.constant 1 : index
      piko.place %f of @a in %bin : !piko.prim<@F>
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      // CHECK: piko.items of @a lanes items {
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
      }
    }
  }
}

// All primitives have four iterations: none waits for another.
// CHECK-LABEL: piko.pipeline @Alike
// CHECK: piko.items of @a lanes items {
// REMARK: remark: stage 'a': lanes are given items
// REMARK: note: iterations of this parallel loop: 4; operations of each: 3, around the loop: 1
// REMARK: note: not iterations: {{[0-9.]+}} times the operations
// REMARK: note: not collapsed: {{[0-9.]+}} times the operations
piko.pipeline @Alike rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.constant 4 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %j = arith.index_cast %i : index to i32
          %k = arith.addi %x, %j : i32
          piko.store %k, @out[%k : i32] "x" : i32
          piko.yield
        }
      }
    }
  }
}

// A box in a bin of 4 x 4 has few pixels, one in a bin of 64 x 64 many: with
// these, all lanes are busy for most of the time.
// CHECK-LABEL: piko.pipeline @Boxes
// CHECK: piko.items of @small lanes collapsed {
// CHECK: piko.items of @large lanes iterations {
// REMARK: remark: stage 'small': lanes are given collapsed
// REMARK: note: iterations of this parallel loop: about 1, at most about 16; operations of each: 2, around the loop: 5
// REMARK: remark: stage 'large': lanes are given iterations
// REMARK: note: iterations of this parallel loop: about 441, at most about 4096; operations of each: 2, around the loop: 5
piko.pipeline @Boxes rank 2 {
  piko.image @image : @F rank 2
  piko.source @small
  piko.source @large
  piko.stage @small bins [4, 4] threads 1 ordered : @F -> [] {}
  piko.stage @large bins [64, 64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_small {
    piko.bins of @small {
    ^bb0(%bin: index):
      piko.items of @small {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %y = piko.get %f "y" : !piko.prim<@F> -> i32
        %one = arith.constant 1 : i32
        %x1 = arith.addi %x, %one : i32
        %y1 = arith.muli %y, %y : i32
        %y2 = arith.addi %y1, %one : i32
        piko.parallel_pixels (%x, %y) to (%x1, %y2) {
        ^bb0(%px: i32, %py: i32):
          piko.update @image[%px, %py : i32, i32] in %bin {
          ^bb0(%a: i32, %b: i32):
            %c = arith.addi %a, %x : i32
            %d = arith.addi %b, %y : i32
            piko.yield [%c, %d : i32, i32]
          }
          piko.yield
        }
      }
    }
  }
  piko.kernel @kernel_large {
    piko.bins of @large {
    ^bb0(%bin: index):
      piko.items of @large {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %y = piko.get %f "y" : !piko.prim<@F> -> i32
        %one = arith.constant 1 : i32
        %x1 = arith.addi %x, %one : i32
        %y1 = arith.muli %y, %y : i32
        %y2 = arith.addi %y1, %one : i32
        piko.parallel_pixels (%x, %y) to (%x1, %y2) {
        ^bb0(%px: i32, %py: i32):
          piko.update @image[%px, %py : i32, i32] in %bin {
          ^bb0(%a: i32, %b: i32):
            %c = arith.addi %a, %x : i32
            %d = arith.addi %b, %y : i32
            piko.yield [%c, %d : i32, i32]
          }
          piko.yield
        }
      }
    }
  }
}

// Iterations that meet, and those over a list, are what lanes are given. A list
// without any has one lane.
// CHECK-LABEL: piko.pipeline @Lists
// CHECK: piko.items of @a lanes iterations {
// CHECK: piko.lists of @b from @a[0] lanes iterations {
// CHECK: piko.lists of @c from @b[0] lanes one {
// REMARK: remark: stage 'a': lanes are given iterations
// REMARK: note: not items: the iterations of a parallel loop meet
// REMARK: note: not collapsed: the iterations of a parallel loop meet
// REMARK: remark: stage 'b': lanes are given iterations
// REMARK: note: not items: a list is one item
// REMARK: note: not collapsed: a list is one item
// REMARK: remark: stage 'c': lanes are given one, because a list is one item and there is no parallel loop
piko.pipeline @Lists rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [@F] {}
  piko.stage @c bins [8] threads 1 : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 4 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.sync
          piko.yield
        }
      }
      piko.lists of @b from @a[0] {
      ^bb0(%l: !piko.list<@F>):
        %n = piko.list_size %l : !piko.list<@F>
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          piko.yield
        }
      }
      piko.lists of @c from @b[0] {
      ^bb0(%l: !piko.list<@F>):
        %n = piko.list_size %l : !piko.list<@F>
      }
    }
  }
}

// An effect outside of the loop keeps pairs from being taken in any order.
// CHECK-LABEL: piko.pipeline @Effects
// CHECK: piko.items of @a lanes items {
// REMARK: remark: stage 'a': lanes are given items
// REMARK: note: not collapsed: there are effects outside of the parallel loop
piko.pipeline @Effects rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %n = arith.index_cast %x : i32 to index
        piko.store %x, @out[%x : i32] "x" : i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          %j = arith.index_cast %i : index to i32
          piko.store %j, @out[%i : index] "x" : i32
          piko.yield
        }
      }
    }
  }
}

// What the schedule says comes first, and for a source what it has to be.
// CHECK-LABEL: piko.pipeline @Said
// CHECK: piko.items of @a source 0 lanes items {
// CHECK: piko.items of @a lanes one {
// REMARK: remark: stage 'a': lanes are given one, as is specified
piko.pipeline @Said rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {
    piko.schedule load_balance lanes one
  }
  piko.kernel @source_0_a {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      %bin = arith.constant 1 : index
      piko.place %f of @a in %bin : !piko.prim<@F>
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
      }
    }
  }
}

// A count from a constant is the same for all primitives, one from state that
// the kernel writes, or from the primitive, is not.
// CHECK-LABEL: piko.pipeline @Counts
// REMARK: remark: stage 'a'
// REMARK: note: iterations of this parallel loop: about 64; operations of each: 1, around the loop: 4
// REMARK: note: iterations of this parallel loop: about 16, at most about 64; operations of each: 0, around the loop: 4
piko.pipeline @Counts rank 1 {
  piko.constant @n : @F
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %zero = arith.constant 0 : index
        %c = piko.load @n "x" : i32
        %n = arith.index_cast %c : i32 to index
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.store %c, @out[%i : index] "x" : i32
          piko.yield
        }
        %d = piko.load @out[%zero : index] "x" : i32
        %m = arith.index_cast %d : i32 to index
        piko.parallel_for %m {
        ^bb0(%i: index):
          piko.yield
        }
      }
    }
  }
}
