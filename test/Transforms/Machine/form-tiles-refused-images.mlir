// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-tiles))' --split-input-file --verify-diagnostics %s
//
// Images that cannot have tiles.

piko.record @F {"x" : i32 at 0} size 4 align 4
// An atomic.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note @below {{this is an atomic; change the pixel by update}}
        piko.atomic add @count[%x : i32] "x", %x : i32
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
// A read of any pixel.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
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
        // expected-note @below {{this pixel is not proved to be in the bin; read it in an update, or at a pixel of parallelForPixels}}
        %v = piko.load @count[%x : i32] "x" : i32
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
// A store to any pixel.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
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
        // expected-note @below {{this pixel is not proved to be in the bin; read it in an update, or at a pixel of parallelForPixels}}
        piko.store %x, @count[%x : i32] "x" : i32
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
// Too many pixels.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  // expected-note @below {{tiles of a kernel may have 65536 bytes, but these have 80000; give the stage smaller bins}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [20000] threads 1 ordered : @F -> [] {}
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
// A program that leaves the image as it is.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  // expected-note @below {{the program does not clear it}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
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
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// A kernel in front that reads the image.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'last' has no tiles of 'count'}}
  piko.image @count : @F rank 1
  piko.source @last
  piko.stage @last bins [8] threads 1 ordered : @F -> [] {}
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
  piko.kernel @before {
    %c0 = arith.constant 0 : index
    // expected-note @below {{this reads the image before; let it follow, by endStage}}
    %v = piko.load checked @count[%c0 : index] "x" : i32
  }
  piko.program {
    piko.clear @count
    piko.launch @before() : () -> ()
    %source = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @last(concatenate %source) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// Two kernels that write, and a cycle, which may not run.
piko.pipeline @P rank 1 {
  // expected-remark @below {{stage 'split' has no tiles of 'both'}}
  // expected-remark @below {{stage 'last' has no tiles of 'both'}}
  piko.image @both : @F rank 1
  // expected-remark @below {{stage 'split' has no tiles of 'own'}}
  piko.image @own : @F rank 1
  piko.source @split
  piko.edge @split[0] -> @split
  piko.edge @split[1] -> @last
  // expected-note @below {{the stage is on a cycle, and may not run at all; let one after the cycle do that}}
  piko.stage @split bins [8] threads 1 ordered placed : @F -> [@F, @F] {}
  piko.stage @last bins [8] threads 1 ordered placed : @F -> [] {}
  piko.kernel @kernel_split {
    piko.bins of @split {
    ^bb0(%bin: index):
      piko.items of @split {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note @below {{another kernel writes it, too; let one stage do that, or stages with the same bins that become one kernel}}
        piko.update @both[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
        piko.update @own[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
        %p = piko.emit 0 (%x) : i32 -> !piko.prim<@F>
        piko.place %p of @split in %bin : !piko.prim<@F>
        %q = piko.emit 1 (%x) : i32 -> !piko.prim<@F>
        piko.place %q of @last in %bin : !piko.prim<@F>
      }
    }
  }
  piko.kernel @kernel_last {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note @below {{another kernel writes it, too}}
        piko.update @both[%x : i32] in %bin {
        ^bb0(%old: i32):
          piko.yield [%x : i32]
        }
      }
    }
  }
  piko.program {
    piko.clear @both, @own
    %source = piko.feed 0 : !piko.edge<@F>
    %out = piko.waves(%source) {
    ^bb0(%first: !piko.edge<@F>, %again: !piko.edge<@F>):
      %bins = piko.join @split(concatenate %first, permute %again)
        : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
      %half, %done = piko.launch @kernel_split(%bins)
        : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
      piko.leave %done : !piko.edge<@F> again %half : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    %all = piko.join @last(permute %out) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kernel_last(%all) : (!piko.bins<@F>) -> ()
  }
}
