// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {
    // expected-error@+1 {{expected a stage to wait for another, but @a waits for itself}}
    piko.schedule load_balance end_stage [@a]
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    // expected-error @below {{expected batch only in a stage that takes a list, but 'a' does not}}
    piko.schedule load_balance batch 4
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
    // expected-error @below {{expected every_bin only in a stage that takes a list, but 'a' does not}}
    piko.schedule load_balance every_bin
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
  piko.stage @a bins [0] threads 1 : list @F -> [] {
    // expected-error @below {{expected one block argument of type '!piko.list<@F>'}}
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      // expected-error @below {{expected a schedule to read constants only, but got @b}}
      %x = piko.load @b[%bin : index] "x" : i32
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
    // expected-error @below {{expected one block argument of type 'index'}}
    piko.schedule load_balance dynamic {
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
    piko.schedule load_balance dynamic {
    ^bb0(%bin: index):
      // expected-error @below {{expected to be in a stage that takes a list, but 'a' does not}}
      piko.set_every_bin
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
      %n = arith.constant 1 : i64
      // expected-error @below {{expected to be inside a dynamic schedule}}
      piko.set_batch %n
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  // expected-error @below {{expected 'piko.cpp_name' to be a string, but got 1 : i64}}
  piko.stage @a bins [0] threads 1 : @F -> [] attributes {piko.cpp_name = 1} {
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
    // expected-error @below {{expected one that is resolved to have no dynamic body}}
    piko.schedule direct_map resolved dynamic {
    ^bb0(%bin: index):
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
