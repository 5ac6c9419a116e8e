// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-tiles))' --split-input-file --verify-diagnostics %s
//
// Bins that cannot have tiles.

piko.record @F {"x" : i32 at 0} size 4 align 4
// A bin without an extent.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  // expected-note @below {{a bin is the whole domain; give the stage bins of a size}}
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Owners of pixels.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  // expected-note @below {{threads share a bin by the pixels that primitives update; give the stage smaller bins}}
  piko.stage @last bins [64] threads 1 tile 8 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Threads with primitives of one bin, as nothing shows their order.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  // expected-note @below {{threads share the primitives of a bin; let the stage change pixels by update}}
  piko.stage @last bins [8] threads 1 split : @F -> [] {}
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.store %x, @count[%x : i32] "x" {piko.inside} : i32
      }
    }
  }
  piko.program {
    piko.clear @count
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Several calls for a bin.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  // expected-note @below {{its list may be cut into batches; leave out batch}}
  piko.stage @last bins [8] threads 1 ordered : list @F -> [] { piko.schedule load_balance batch 4 }
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.lists of @last {
      ^bb0(%f: !piko.list<@F>):
        %c0 = arith.constant 0 : index
        %p = piko.list_at %f[%c0] : !piko.list<@F> -> !piko.prim<@F>
        %x = piko.get %p "x" : !piko.prim<@F> -> i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Calls that depend on the bin.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  // expected-note @below {{its list may be cut into batches; leave out batch}}
  piko.stage @last bins [8] threads 1 ordered : list @F -> [] {}
  piko.kernel @schedule_last {
    %bins = piko.begin_schedule @last
  }
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.lists of @last {
      ^bb0(%l: !piko.list<@F>):
        %x = arith.constant 0 : i32
        piko.update @count[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @count
    piko.launch @schedule_last() : () -> ()
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}
