// RUN: piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-to-grids))' --split-input-file --verify-diagnostics
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=48}))' --split-input-file 2>&1 | FileCheck %s --check-prefix=THREADS
// RUN: not piko-opt %s --pass-pipeline='builtin.module(piko.pipeline(piko-map-threads{threads=2048}))' --split-input-file 2>&1 | FileCheck %s --check-prefix=THREADS
// THREADS: error: expected a power of two up to 1024 for the threads of a block, but got {{48|2048}}

// A grid is what a mapping says, or an error.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Unmapped rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  // expected-error @below {{expected a mapping to threads, as piko-map-threads makes it}}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @UnmappedLoop rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 32 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        // expected-error @below {{expected a mapping to threads, as piko-map-threads makes it}}
        piko.parallel_for %n {
        ^bb0(%i: index):
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Ordered rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 32 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error @below {{cannot be shared by threads as #piko<threads shared>}}
      piko.items of @a attributes {piko.threads = #piko<threads shared>} {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @image[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @TooMany rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 4 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a attributes {piko.threads = #piko<threads one>} {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        // expected-error @below {{cannot be shared by threads as #piko<threads lockstep>}}
        piko.parallel_for %n attributes {piko.threads = #piko<threads lockstep>} {
        ^bb0(%i: index):
          piko.sync
          piko.yield
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoPixels rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 4 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error @below {{cannot be shared by threads as #piko<threads collapsed>}}
      piko.items of @a attributes {piko.threads = #piko<threads collapsed>} {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.atomic add @out[%n : index] "x", %x : i32
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Pixels rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 4 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a attributes {piko.threads = #piko<threads collapsed>} {
      ^bb0(%f: !piko.prim<@F>):
        %zero = arith.constant 0 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-error @below {{all primitives have the same pixels}}
        piko.update @image[%zero : index] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @BlockSize rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  // expected-error @below {{expected a power of two up to 1024 for the threads of a block, but got 48}}
  piko.kernel @kernel_a attributes {piko.block_size = 48 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a attributes {piko.threads = #piko<threads one>} {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Nested rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : @F -> [] {}
  piko.kernel @kernel_a attributes {piko.block_size = 32 : i64} {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a attributes {piko.threads = #piko<threads shared>} {
      ^bb0(%f: !piko.prim<@F>):
        %n = arith.constant 8 : index
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-error @below {{cannot be shared by threads as #piko<threads shared>}}
        piko.parallel_for %n attributes {piko.threads = #piko<threads shared>} {
        ^bb0(%i: index):
          piko.atomic add @out[%i : index] "x", %x : i32
          piko.yield
        }
      }
    }
  }
}

// -----

// A table that a primitive writes says where its pixels are.
piko.record @Box {"x" : i32 at 0, "to" : i32 at 4} size 8 align 4
piko.record @Pixel {"n" : i32 at 0} size 4 align 4
piko.pipeline @Table rank 1 {
  piko.image @image : @Pixel rank 1
  piko.source @draw
  piko.stage @draw bins [8] threads 64 placed : @Box -> [] {}
  piko.kernel @kernel_draw attributes {piko.block_size = 32 : i64} {
    piko.bins of @draw {
    ^bb0(%bin: index):
      // expected-error @below {{where its pixels are depends on an array}}
      piko.items of @draw attributes {piko.threads = #piko<threads collapsed>} {
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
