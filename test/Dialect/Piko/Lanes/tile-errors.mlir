// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @values : @F
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected an image, but got @values, which is none}}
      %t = piko.tile @values in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @values in %bin : !piko.tile<@F, [8]>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"y" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected a tile of record @F, but got @G}}
      %t = piko.tile @image in %bin : !piko.tile<@G, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@G, [8]>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected the extents of the bins of @a, [8], of which none is 0, but got [16]}}
      %t = piko.tile @image in %bin : !piko.tile<@F, [16]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@F, [16]>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %c0 = arith.constant 0 : index
      // expected-error@+1 {{expected the bin that is being run}}
      %t = piko.tile @image in %c0 : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @image in %c0 : !piko.tile<@F, [8]>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-error@+1 {{expected one 'piko.write_tile' of it}}
      %t = piko.tile @image in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.image @other : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-error@+1 {{expected the tile of @other, but got that of @image}}
        piko.store %x, @other[%x : i32] "x" tile(%t : !piko.tile<@F, [8]>) : i32
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@F, [8]>
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.image @other : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      // expected-error@+1 {{expected the image and the bin that the tile is of}}
      piko.write_tile %t to @other in %bin : !piko.tile<@F, [8]>
    }
  }
}

// -----

// What a launch says that it clears is what the tiles of its kernel clear.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image clear in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@F, [8]>
    }
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    // expected-error@+1 {{expected to clear @image, as the tile in @k does}}
    piko.launch @k(%bins) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
    }
  }
  piko.program {
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    // expected-error@+1 {{expected a tile in @k that begins with the clear value of @image}}
    piko.launch @k(%bins) clears @image : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [8] threads 1 : @F -> [] {}
  piko.kernel @k {
    piko.bins of @a {
    ^bb0(%bin: index):
      %t = piko.tile @image clear in %bin : !piko.tile<@F, [8]>
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
      }
      piko.write_tile %t to @image in %bin : !piko.tile<@F, [8]>
    }
  }
  piko.program {
    piko.clear @image
    %in = piko.feed 0 : !piko.edge<@F>
    %bins = piko.join @a(concatenate %in) : (!piko.edge<@F>) -> !piko.bins<@F>
    // expected-error@+1 {{expected @image to be cleared once, but 'piko.clear' does, too}}
    piko.launch @k(%bins) clears @image : (!piko.bins<@F>) -> ()
  }
}
