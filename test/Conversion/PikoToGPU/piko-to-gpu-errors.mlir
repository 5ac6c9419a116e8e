// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-map-threads,piko-to-grids))' --split-input-file --verify-diagnostics %s
// What a kernel on a GPU cannot do, and why threads do not share the pixels of a
// bin.

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Function rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    // expected-remark @below {{the threads of a block take one primitive after the other: a bin is the whole domain}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      // expected-error @below {{a kernel for a GPU uses 'math.exp', which has other bits there}}
      %e = math.exp %x : f32
      %zero = arith.constant 0 : index
      piko.update @image[%zero : index] {
      ^bb0(%old: f32):
        piko.yield [%e : f32]
      }
      piko.return
    }
  }
}

// -----

// Without piko-expand-remainders.
piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Remainder rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    // expected-remark @below {{the threads of a block take one primitive after the other: a bin is the whole domain}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      // expected-error @below {{a kernel for a GPU uses 'arith.remf', which has other bits there}}
      %e = arith.remf %x, %x : f32
      %zero = arith.constant 0 : index
      piko.update @image[%zero : index] {
      ^bb0(%old: f32):
        piko.yield [%e : f32]
      }
      piko.return
    }
  }
}

// -----

// Only the thread of a pixel knows whether an update of it passed.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Outcome rank 1 {
  piko.image @image : @F rank 1
  piko.image @counts : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : index
      %eight = arith.constant 8 : index
      %one = arith.constant 1 : index
      %none = arith.constant 0 : i32
      %passed = scf.for %i = %zero to %eight step %one iter_args(%n = %none) -> i32 {
        // expected-remark @below {{the threads of a block do not share pixels: the outcome of an update decides about other pixels}}
        %p = piko.update @image[%i : index] {
        ^bb0(%old: i32):
          %less = arith.cmpi slt, %x, %old : i32
          piko.yield [%x : i32] results [%less : i1]
        } -> i1
        %more = arith.extui %p : i1 to i32
        %sum = arith.addi %n, %more : i32
        scf.yield %sum : i32
      }
      piko.update @counts[%zero : index] {
      ^bb0(%old: i32):
        piko.yield [%passed : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Neighbour rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %one = arith.constant 1 : i32
      %y = arith.addi %x, %one : i32
      %p = piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        %less = arith.cmpi slt, %x, %old : i32
        piko.yield [%x : i32] results [%less : i1]
      } -> i1
      scf.if %p {
        // expected-remark @below {{the threads of a block do not share pixels: an update follows from that of another pixel}}
        piko.update @image[%y : i32] {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Store rank 1 {
  piko.image @image : @F rank 1
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-remark @below {{the threads of a block do not share pixels: what is written does not follow from the update of a pixel}}
      piko.store %x, @out[%x : i32] "x" : i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// What the thread of another pixel has in the array is not known.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Array rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : index
      %array = memref.alloca() : memref<4xi32>
      %p = piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        %less = arith.cmpi slt, %x, %old : i32
        piko.yield [%x : i32] results [%less : i1]
      } -> i1
      scf.if %p {
        // expected-remark @below {{the threads of a block do not share pixels: an array outlives the pixel that it is written for}}
        memref.store %x, %array[%zero] : memref<4xi32>
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Local rank 1 {
  piko.source @start
  piko.edge @start[0] -> @last local
  piko.stage @start bins [8] threads 64 : @F -> [@F] {}
  piko.stage @last bins [8] threads 64 : list @F -> [] {}
  piko.kernel @kernel_start {
    piko.bins of @start {
    ^bb0(%bin: index):
      piko.items of @start {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        %other = arith.index_cast %x : i32 to index
        // expected-error @below {{a kernel for a GPU places what a local edge takes in the same bin}}
        piko.place %p of @last in %other : !piko.prim<@F>
      }
      piko.lists of @last from @start[0] {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

// What the CPU's lowering makes is no kernel of the machine level.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Units rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 64 : @F -> [] {}
  // expected-error @below {{expected work on bins, as piko-form-work makes it}}
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

// Memory of a type that no array has.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Lives rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [8] threads 64 placed : list @F -> [] {}
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
        %n = arith.constant 8 : index
        %yes = arith.constant true
        piko.parallel_for %n {
        ^bb0(%i: index):
          %x = arith.index_cast %i : index to i32
          %v = vector.broadcast %x : i32 to vector<2xi32>
          // expected-error @below {{expected a number, a primitive or a private array to live across a barrier, but got type 'vector<2xi32>'}}
          %kept = scf.if %yes -> vector<2xi32> {
            piko.store %x, @out[%i : index] "x" : i32
            scf.yield %v : vector<2xi32>
          } else {
            scf.yield %v : vector<2xi32>
          }
          piko.sync
          %y = vector.extract %kept[0] : i32 from vector<2xi32>
          piko.store %y, @out[%i : index] "x" : i32
          piko.yield
        }
      }
    }
  }
}
