// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32}))' --split-input-file --verify-diagnostics | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads))' --split-input-file 2>/dev/null | FileCheck %s --check-prefix=DEFAULT
// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=32 group=false}))' --split-input-file 2>/dev/null | FileCheck %s --check-prefix=PLAIN
// PLAIN-NOT: piko.grouped
// PLAIN:     piko.pipeline @Barriers
// PLAIN-NOT: piko.grouped
// Who takes what of a kernel's work. Without an option a block has the threads of its
// stage, or more for a large bin.

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// Loops that count become scf.for, and what pixels have in common leaves them.
// CHECK-LABEL: piko.pipeline @Collapsed
// CHECK:         piko.kernel @kernel_draw attributes {piko.block_size = 32 : i64} {
// CHECK:             piko.items of @draw attributes {piko.threads = #piko<threads collapsed>} {
// CHECK-NOT:           scf.while
// CHECK:               arith.muli
// CHECK:               scf.for
// CHECK-NEXT:            piko.update
// DEFAULT-LABEL: piko.pipeline @Collapsed
// DEFAULT:         piko.kernel @kernel_draw attributes {piko.block_size = 64 : i64} {
piko.pipeline @Collapsed rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [8, 8] threads 64 placed : @Box -> [] {}
  piko.kernel @kernel_draw {
    piko.bins of @draw {
    ^bb0(%bin: index):
      piko.items of @draw {
      ^bb0(%f: !piko.prim<@Box>):
        %x = piko.get %f "x" : !piko.prim<@Box> -> i32
        %y = piko.get %f "y" : !piko.prim<@Box> -> i32
        %to = piko.get %f "to" : !piko.prim<@Box> -> i32
        %one = arith.constant 1 : i32
        %end = scf.while (%i = %x) : (i32) -> i32 {
          %more = arith.cmpi slt, %i, %to : i32
          scf.condition(%more) %i : i32
        } do {
        ^bb0(%i: i32):
          %value = arith.muli %to, %y : i32
          piko.update @image[%i, %y : i32, i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%value : i32]
          }
          %next = arith.addi %i, %one : i32
          scf.yield %next : i32
        }
      }
    }
  }
}

// -----

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// One loop counts to both coordinates: no box.
// CHECK-LABEL: piko.pipeline @Diagonal
// CHECK:         piko.items of @draw attributes {piko.threads = #piko<threads pixels>} {
// DEFAULT-LABEL: piko.pipeline @Diagonal
// DEFAULT:         piko.kernel @kernel_draw attributes {piko.block_size = 256 : i64} {
piko.pipeline @Diagonal rank 2 {
  piko.image @image : @Pixel rank 2
  piko.source @draw
  piko.stage @draw bins [64, 64] threads 64 placed : @Box -> [] {}
  piko.kernel @kernel_draw {
    piko.bins of @draw {
    ^bb0(%bin: index):
      piko.items of @draw {
      ^bb0(%f: !piko.prim<@Box>):
        %x = piko.get %f "x" : !piko.prim<@Box> -> i32
        %to = piko.get %f "to" : !piko.prim<@Box> -> i32
        %one = arith.constant 1 : i32
        // expected-remark @below {{the threads of a block take one primitive after the other: a loop counts to two coordinates}}
        scf.for %i = %x to %to step %one : i32 {
          piko.update @image[%i, %i : i32, i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%to : i32]
          }
        }
      }
    }
  }
}

// -----

piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// Not the pixel that is counted to, but that of its low bits.
// CHECK-LABEL: piko.pipeline @LowBits
// CHECK:         piko.items of @draw attributes {piko.threads = #piko<threads pixels>} {
piko.pipeline @LowBits rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @draw
  piko.stage @draw bins [8] threads 64 placed : @Box -> [] {}
  piko.kernel @kernel_draw {
    piko.bins of @draw {
    ^bb0(%bin: index):
      piko.items of @draw {
      ^bb0(%f: !piko.prim<@Box>):
        %x = piko.get %f "x" : !piko.prim<@Box> -> i32
        %to = piko.get %f "to" : !piko.prim<@Box> -> i32
        %one = arith.constant 1 : i32
        scf.for %i = %x to %to step %one : i32 {
          %low = arith.trunci %i : i32 to i8
          %at = arith.extsi %low : i8 to i32
          // expected-remark @below {{the threads of a block take one primitive after the other: a coordinate has less than 32 bits}}
          piko.update @image[%at : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%to : i32]
          }
        }
      }
    }
  }
}

// -----

// Where the pixels are, each primitive finds in a table that it writes.
piko.record @Box {"x" : i32 at 0, "y" : i32 at 4, "to" : i32 at 8} size 12 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Table
// CHECK:         piko.items of @draw attributes {piko.threads = #piko<threads pixels>} {
piko.pipeline @Table rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @draw
  piko.stage @draw bins [8] threads 64 placed : @Box -> [] {}
  piko.kernel @kernel_draw {
    piko.bins of @draw {
    ^bb0(%bin: index):
      // expected-remark @below {{the threads of a block take one primitive after the other: where its pixels are depends on an array}}
      piko.items of @draw {
      ^bb0(%f: !piko.prim<@Box>):
        %x = piko.get %f "x" : !piko.prim<@Box> -> i32
        %to = piko.get %f "to" : !piko.prim<@Box> -> i32
        %one = arith.constant 1 : i32
        %table = memref.alloca() : memref<4xi32>
        %at = arith.index_cast %x : i32 to index
        %lo = memref.load %table[%at] : memref<4xi32>
        scf.for %i = %lo to %to step %one : i32 {
          piko.update @image[%i : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%to : i32]
          }
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Primitives of one kernel, and iterations of the others.
// CHECK-LABEL: piko.pipeline @Shared
// CHECK:         piko.items of @a attributes {piko.threads = #piko<threads shared>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
// CHECK:         piko.items of @b lanes iterations attributes {piko.fewest = 2 : i64, piko.threads = #piko<threads by_count>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads shared>} {
// CHECK:             piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
// CHECK:         piko.items of @c lanes one attributes {piko.threads = #piko<threads one>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
piko.pipeline @Shared rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.source @b
  piko.source @c
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.stage @b bins [8] threads 64 placed : @F -> [] {}
  piko.stage @c bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.atomic add @out[%i : index] "x", %x : i32
          piko.yield
        }
      }
    }
  }
  piko.kernel @kernel_b {
    piko.bins of @b {
    ^bb0(%bin: index):
      piko.items of @b lanes iterations {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.parallel_for %n {
          ^bb0(%j: index):
            piko.atomic add @out[%j : index] "x", %x : i32
            piko.yield
          }
          piko.yield
        }
      }
    }
  }
  piko.kernel @kernel_c {
    piko.bins of @c {
    ^bb0(%bin: index):
      piko.items of @c lanes one {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.atomic add @out[%i : index] "x", %x : i32
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Barriers
// CHECK:         piko.lists of @a attributes {piko.threads = #piko<threads one>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads lockstep>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads pieces>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads pieces>} {
// CHECK:             piko.sync
// CHECK:             piko.grouped where %true{{.*}} by
// CHECK:         piko.lists of @b lanes one attributes {piko.threads = #piko<threads one>} {
// CHECK:           piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads pieces_of_one>} {
piko.pipeline @Barriers rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.source @b
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.stage @b bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %few = arith.constant 24 : index
        %many = arith.constant 33 : index
        %zero = arith.constant 0 : index
        %none = arith.constant 0 : i32
        piko.parallel_for %few {
        ^bb0(%i: index):
          piko.sync
          piko.update @image[%i : index] {
          ^bb0(%old: i32):
            piko.yield [%none : i32]
          }
          piko.yield
        }
        // expected-remark @below {{what iterations keep across barriers is in memory: they are not known to be at most 32, the threads of a block}}
        piko.parallel_for %many {
        ^bb0(%i: index):
          piko.sync
          piko.yield
        }
        piko.parallel_for %few {
        ^bb0(%i: index):
          piko.sync
          piko.update @image[%zero : index] in %bin {
          ^bb0(%old: i32):
            piko.yield [%none : i32]
          }
          piko.yield
        }
      }
    }
  }
  piko.kernel @kernel_b {
    piko.bins of @b {
    ^bb0(%bin: index):
      piko.lists of @b lanes one {
      ^bb0(%l: !piko.list<@F>):
        %few = arith.constant 24 : index
        piko.parallel_for %few {
        ^bb0(%i: index):
          piko.sync
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @Pixel {"n" : f32 at 0} size 4 align 4
// An update in a branch: what precedes it there yields the pixel and what it uses, what
// follows it has the branch to itself.
// CHECK-LABEL: piko.pipeline @Grouped
// CHECK:         piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads pieces>} {
// CHECK:           %[[IS:.*]] = arith.cmpi
// CHECK:           %[[LEFT:.*]]:3 = scf.if %[[IS]] -> (f32, i1, i32) {
// CHECK:             %[[AT:.*]] = arith.addi
// CHECK:             %[[VALUE:.*]] = arith.mulf
// CHECK:             scf.yield %[[VALUE]], %true{{.*}}, %[[AT]] : f32, i1, i32
// CHECK:             scf.yield %{{.*}}, %false{{.*}}, %{{.*}} : f32, i1, i32
// CHECK:           %[[PASSED:.*]] = piko.grouped where %[[LEFT]]#1 by %[[LEFT]]#2 : i32 with %[[LEFT]]#0 : f32 {
// CHECK:           ^bb0(%[[X:.*]]: i32, %[[V:.*]]: f32):
// CHECK:             %[[OLD:.*]] = piko.update @image[%[[X]] : i32] in %{{.*}} {
// CHECK:               arith.addf %{{.*}}, %[[V]]
// CHECK:             piko.yield results[%[[OLD]] : f32]
// CHECK:           scf.if %[[IS]] {
// CHECK-NEXT:        arith.subf %[[PASSED]], %[[LEFT]]#0
// CHECK:             piko.store
// CHECK:           } else {
// CHECK-NEXT:        piko.store
piko.pipeline @Grouped rank 1 {
  piko.image @image : @Pixel rank 1
  piko.buffer @out : @Pixel
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = piko.list_size %l : !piko.list<@F>
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          %z = piko.get %f "z" : !piko.prim<@F> -> f32
          %four = arith.constant 4 : i32
          %is = arith.cmpi slt, %x, %four : i32
          scf.if %is {
            %at = arith.addi %x, %four : i32
            %value = arith.mulf %z, %z : f32
            %passed = piko.update @image[%at : i32] in %bin {
            ^bb0(%old: f32):
              %sum = arith.addf %old, %value : f32
              piko.yield [%sum : f32] results [%old : f32]
            } -> f32
            %rest = arith.subf %passed, %value : f32
            piko.store %rest, @out[%i : index] "n" : f32
          } else {
            piko.store %z, @out[%i : index] "n" : f32
          }
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @NotGrouped
// CHECK-NOT:     piko.grouped
// CHECK:         piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
// CHECK-NOT:     piko.grouped
// CHECK:         piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
// CHECK-NOT:     piko.grouped
// CHECK:         piko.parallel_for %{{.*}} attributes {piko.threads = #piko<threads one>} {
piko.pipeline @NotGrouped rank 1 {
  piko.image @image : @Pixel rank 1
  piko.image @other : @Pixel rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = piko.list_size %l : !piko.list<@F>
        %zero = arith.constant 0 : index
        %one = arith.constant 1 : index
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          scf.for %k = %zero to %i step %one {
            // expected-remark @below {{one thread does what iterations do that may update a pixel of another one: an iteration updates pixels in a loop of its own; a parallel loop over all of its pixels would be shared}}
            piko.update @image[%x : i32] in %bin {
            ^bb0(%old: i32):
              piko.yield [%x : i32]
            }
          }
          piko.yield
        }
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          piko.update @image[%x : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          // expected-remark @below {{an iteration has two updates of one image; one update would be shared}}
          piko.update @image[%i : index] in %bin {
          ^bb0(%old: i32):
            piko.yield [%x : i32]
          }
          piko.yield
        }
        piko.parallel_for %n {
        ^bb0(%i: index):
          %f = piko.list_at %l[%i] : !piko.list<@F> -> !piko.prim<@F>
          %x = piko.get %f "x" : !piko.prim<@F> -> i32
          // expected-remark @below {{iterations update this image, and access it in other ways, too}}
          %now = piko.load @image[%i : index] "n" : i32
          piko.update @image[%x : i32] in %bin {
          ^bb0(%old: i32):
            piko.yield [%now : i32]
          }
          piko.yield
        }
      }
    }
  }
}
