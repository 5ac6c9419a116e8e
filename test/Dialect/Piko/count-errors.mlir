// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  // expected-error@+1 {{expected a piece of state with 'reads'}}
  piko.counter 0 reads of "s"
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  // expected-error@+1 {{expected no piece of state with 'trips'}}
  piko.counter 0 trips of "s" to @b
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  // expected-error@+1 {{expected a port with 'emissions' alone}}
  piko.counter 0 calls of "s" port 0
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  // expected-error@+1 {{expected it inside of an earlier counter, but got 0}}
  piko.counter 0 trips of "s" inside 0
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected a buffer or an image, but got @c, which is none}}
  piko.counter 0 reads of "s" to @c
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.image @image : @F rank 2
  piko.source @s
  piko.stage @s bins [0, 0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      // expected-error@+1 {{expected 2 indices into @image, but got 1}}
      piko.count_element 0 @image[%i : index] 4 bytes at 0
      piko.return
    }
  }
}
