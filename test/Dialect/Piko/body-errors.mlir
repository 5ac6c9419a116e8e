// RUN: piko-opt %s --split-input-file --verify-diagnostics

// expected-note@+1 {{the record is declared here}}
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{record @F has no field 'y'}}
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
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
      // expected-error@+1 {{expected field 'x' to be of type 'i32', but got 'f32'}}
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32[4 : 4] at 0} size 16 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected 1 indices into field 'x', but got 0}}
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [8, 8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected to be inside a process phase}}
      piko.emit 0 (%x) : i32
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
  piko.image @ids : @F rank 2
  piko.edge @a[0] -> @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @ids[%x, %x : i32, i32] {
      ^bb0(%old: i32):
        // expected-error@+1 {{expected to be outside an update}}
        piko.emit 0 (%x) : i32
        piko.yield [%old : i32]
      }
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
      // expected-error@+1 {{expected a port below 0, which is how many stage 'a' has, but got 0}}
      piko.emit 0
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0, "y" : f32 at 4} size 8 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.edge @a[0] -> @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected the numbers of record @F, 2 of types ('i32', 'f32'), but got ('i32')}}
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 3 {
  piko.source @a
  piko.stage @a bins [8, 8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected 3 coordinates, the rank of the pipeline, but got 2}}
      %b = piko.bin_at %x, %x : i32, i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      // expected-error@+1 {{must be variadic of cell coordinate (i32, i64 or index), but got 'f32'}}
      %b = piko.bin_at %x : f32
      piko.assign_to %b
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
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected 2 coordinates, the rank of the pipeline, but got 1}}
      piko.assign_box [%x, %x : i32, i32] to [%x : i32]
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
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected 2 coordinates, the rank of the pipeline, but got 3}}
      piko.assign_line [%x, %x : i32, i32] to [%x, %x, %x : i32, i32, i32]
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
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected to be inside an assign phase}}
      piko.assign_line [%x : i32] to [%x : i32]
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
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error@+1 {{expected 2 coordinates, the rank of the pipeline, but got 1}}
      piko.owner [%x : i32]
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
      // expected-error@+1 {{expected to be inside an assign phase}}
      piko.assign_all
      piko.return
    }
  }
}
