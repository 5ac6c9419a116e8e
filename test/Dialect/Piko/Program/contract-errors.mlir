// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer or the number of a source}}
  piko.contract @b source 0 "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer or the number of a source}}
  piko.contract "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected one of the 1 sources, but got 1}}
  piko.contract source 1 "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer of the host's, but got @sized, which is none}}
  piko.contract @sized "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer of the host's, but got @image, which is none}}
  piko.contract @image "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer that no stage writes, but got @b}}
  piko.contract @b "v" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : i32
      // expected-note@+1 {{it is written here}}
      piko.store %one, @b[%zero : index] "v"[%zero] : i32
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a field of integers, but got 'z'}}
  piko.contract source 0 "z" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a field of integers, but got 'y'}}
  piko.contract @b "y" below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer that is indexed or a number}}
  piko.contract @b "v" indexes @b below 4
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer that is indexed or a number}}
  piko.contract @b "v"
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a buffer that is indexed, but got @image, which is none}}
  piko.contract @b "v" indexes @image
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0, "v" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.buffer @sized : @F per_source 0
  piko.image @image : @F rank 1
  piko.source @draw
  // expected-error@+1 {{expected a number of at least 1, but got 0}}
  piko.contract source 0 "v" below 0
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
