// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.image @c : @F rank 1
  // expected-error@+1 {{expected a constant or a buffer, but got @c, which is none}}
  piko.fixed @c "z" = 0.0 : f32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected a field of a constant}}
  piko.fixed @c = 1 : index
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  // expected-error@+1 {{expected no field of a buffer, whose size is fixed}}
  piko.fixed @b "z" = 1.0 : f32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  // expected-error@+1 {{expected an index for the size of a buffer, but got 'i32'}}
  piko.fixed @b = 1 : i32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected a field of @c, but got 'x', which is none}}
  piko.fixed @c "x" = 1.0 : f32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected an element from 0 to 1, but got 2}}
  piko.fixed @c "w"[2] = 1 : i32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected a value of 'f32', but got 'i32'}}
  piko.fixed @c "z" = 1 : i32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected no element of a field that is no array}}
  piko.fixed @c "z"[0] = 1.0 : f32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  // expected-error@+1 {{expected an element of an array}}
  piko.fixed @c "w" = 1 : i32
}

// -----

piko.record @F {"z" : f32 at 0, "w" : i32[2 : 4] at 4} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  // expected-error@+1 {{expected how many elements a buffer has}}
  piko.fixed @b = -5 : index
}
