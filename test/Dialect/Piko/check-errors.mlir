// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  // expected-error@+1 {{expected a record, but got @G, which is none}}
  piko.check_record @F of @G
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  // expected-error@+1 {{expected @F to have a field 'piko.lineage'}}
  piko.check_record @F of @F
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      // expected-error@+1 {{expected a buffer or an image, but got @c, which is none}}
      piko.check_access read @c[%i : index]
      piko.return
    }
  }
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
      piko.check_access read @image[%i : index]
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      // expected-error@+1 {{expected an iteration with 'barrier'}}
      piko.check_loop barrier
      piko.return
    }
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      // expected-error@+1 {{expected no iteration with 'end'}}
      piko.check_loop end %i
      piko.return
    }
  }
}
