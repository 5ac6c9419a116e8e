// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %b = piko.bin
      // expected-error@+1 {{expected to be inside an assign phase}}
      piko.assign_to %b
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected a previous stage, but stage 'a' has a source}}
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected stage 'a' to have bins of the same size as 'b', [8, 8], but got [0, 0]}}
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{attribute 'dim' failed to satisfy constraint: 64-bit integer attribute whose value is non-negative}}
      %d = piko.domain[-1]
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Dimension rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error @below {{expected a dimension below 1, the rank of the pipeline, but got 3}}
      %w = piko.domain[3]
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @BinDimension rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %b = piko.bin
      // expected-error @below {{expected a dimension below 1, the rank of the pipeline, but got 5}}
      %x = piko.bin_lo %b[5]
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @DynamicArray rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = piko.domain[0]
      // expected-error @below {{expected a private array of constant size}}
      %array = memref.alloca(%n) : memref<?xi32>
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @s
  piko.stage @s bins [0] threads 1 : list @F -> [] {
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      // expected-error@+1 {{expected a primitive of record @F, but got @G}}
      %g = piko.list_at %l[%zero] : !piko.list<@F> -> !piko.prim<@G>
      piko.return
    }
  }
}

// -----

// Nobody would free what is on the heap.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %n = arith.constant 2 : index
      scf.for %i = %n to %n step %n {
        // expected-error @below {{expected a private array, which is a memref.alloca of constant size, but got memref.alloc}}
        %array = memref.alloc() : memref<8xf32>
      }
      piko.return
    }
  }
}

// -----

func.func private @twice(i32) -> i32
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [4] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error @below {{expected the body of the function in its place, because a phase cannot call functions}}
      %y = func.call @twice(%x) : (i32) -> i32
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [4] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      // expected-error @below {{expected a private array, which is a memref.alloca of constant size, but got memref.alloc}}
      %array = memref.alloc() : memref<8xf32>
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

// One that may never run is left to the test when it does.
piko.record @F {"w" : i32[3 : 4] at 0} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %c0 = arith.constant 0 : index
      %c3 = arith.constant 3 : index
      %zero = arith.constant 0 : i32
      %x = piko.get %f "w"[%c0] : !piko.prim<@F> -> i32
      %none = arith.cmpi eq, %x, %zero : i32
      scf.if %none {
        %y = piko.get %f "w"[%c3] : !piko.prim<@F> -> i32
      }
      // expected-error @below {{'piko.get' op expected an index into field 'w' of at least 0 and below 3, but got 3}}
      %z = piko.get %f "w"[%c3] : !piko.prim<@F> -> i32
      piko.return
    }
  }
}

// -----

piko.record @F {"w" : i32[3 : 4] at 0} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %before = arith.constant -1 : index
      // expected-error @below {{'piko.store' op expected an index into field 'w' of at least 0 and below 3, but got -1}}
      piko.store %zero, @b[%zero : i32] "w"[%before] : i32
      piko.return
    }
  }
}
