// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected no operation of the CPU in a kernel of the machine level}}
      %n = piko.cpu.threads
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected phases (the kernels level) or work (the machine level), but got both}}
  piko.kernel @k {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected work on what the bins hold}}
    piko.bins of @a {
    ^bb0(%bin: index):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected a stage, but got @b, which is none}}
    piko.bins of @b {
    ^bb0(%bin: index):
      piko.items of @b {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected one block argument of type 'index'}}
    piko.bins of @a {
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected a stage that takes lists, but got @a}}
      piko.lists of @a {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected a source outside of 'piko.bins'}}
    piko.items of @a {
    ^bb0(%f: !piko.prim<@F>):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected to take what the bins of @a hold, because it is the first work on them}}
      piko.lists of @b from @a[0] {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      // expected-error@+1 {{expected an edge from port 1 of @a to @b, but there is none}}
      piko.lists of @b from @a[1] {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        // expected-error@+1 {{expected what 'piko.emit' gives, or a primitive of a source}}
        piko.place %f of @b in %bin : !piko.prim<@F>
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-error@+1 {{expected a result of record @F, but got @G}}
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@G>
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : list @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected lanes 'iterations' or 'one', because a list is one item, but got 'collapsed'}}
      piko.lists of @a lanes collapsed {
      ^bb0(%l: !piko.list<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @k {
    // expected-error@+1 {{expected the number of a source of @a, but got 1}}
    piko.items of @a source 1 {
    ^bb0(%f: !piko.prim<@F>):
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [8] threads 1 placed : @F -> [] {}
  piko.kernel @k {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected a primitive of 'piko.items' in 'piko.bins'}}
      %p = piko.position %f : !piko.prim<@F>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b local
  piko.stage @a bins [8] threads 1 placed : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      // expected-error@+1 {{expected work that takes the same after it}}
      piko.items of @b from @a[0] attributes {piko.again} {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}
