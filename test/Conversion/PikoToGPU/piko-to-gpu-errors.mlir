// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-work,piko-form-units,convert-piko-to-gpu))' --split-input-file --verify-diagnostics %s
// What a kernel on a GPU cannot do yet, and where it is said.

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Emits rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 8 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      // expected-error @below {{a kernel for a GPU emits primitives, which is not supported yet}}
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @List rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  // expected-error @below {{a kernel for a GPU takes a list of primitives}}
  piko.stage @a bins [0] threads 8 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      piko.update @image[%zero : index] {
      ^bb0(%old: i32):
        piko.yield [%old : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Function rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
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

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Reads rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error @below {{a kernel for a GPU reads 'image', which it also writes}}
      %y = piko.load @image[%x : i32] "x" : i32
      // expected-note @below {{it is written here}}
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%y : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Old rank 1 {
  piko.image @image : @F rank 1
  piko.buffer @next : @F
  piko.source @a
  piko.stage @a bins [0] threads 8 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : index
      // expected-error @below {{a kernel for a GPU uses what an atomic operation found}}
      %old = piko.atomic add @next[%zero : index] "x", %x : i32 -> i32
      piko.update @image[%x : i32] {
      ^bb0(%before: i32):
        piko.yield [%old : i32]
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
        // expected-error @below {{the outcome of an update decides about other pixels, which is not supported on a GPU yet}}
        %p = piko.update @image[%i : index] {
        ^bb0(%old: i32):
          %less = arith.cmpi slt, %x, %old : i32
          piko.yield [%x : i32] results [%less : i1]
        } -> i1
        %more = arith.extui %p : i1 to i32
        %sum = arith.addi %n, %more : i32
        // expected-note @below {{it is needed here}}
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
      // expected-note @below {{the other update}}
      %p = piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        %less = arith.cmpi slt, %x, %old : i32
        piko.yield [%x : i32] results [%less : i1]
      } -> i1
      scf.if %p {
        // expected-error @below {{an update follows from that of another pixel, which is not supported on a GPU yet}}
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
      // expected-error @below {{expected what a kernel for a GPU writes to follow from the update of a pixel}}
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
        // expected-error @below {{an array outlives the pixel that it is written for}}
        memref.store %x, %array[%zero] : memref<4xi32>
      }
      piko.return
    }
  }
}
