// RUN: piko-opt %s --split-input-file --verify-diagnostics

// expected-error@+1 {{expected field 'x' to be f32, f64, i8, i16, i32 or i64, but got 'f16'}}
piko.record @F {"x" : f16 at 0} size 4 align 4

// -----

// expected-error@+1 {{expected field 'x' to have an offset of at least 0, but got -4}}
piko.record @F {"x" : f32 at -4} size 4 align 4

// -----

// expected-error@+1 {{expected field 'x' to end within 281474976710656 bytes}}
piko.record @Wraps {"x" : f32[9223372036854775807 : 12] at 4} size 20 align 4

// -----

// expected-error@+1 {{expected the counts and strides of field 'x' to be positive, but got 0 : 4}}
piko.record @F {"x" : f32[0 : 4] at 0} size 4 align 4

// -----

// expected-error@+1 {{expected field 'x' to end within the record's 4 bytes, but got 8}}
piko.record @F {"x" : f64 at 0} size 4 align 4

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{port 0 of stage 'a' is not connected}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.source @a
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-note@+1 {{the other edge is here}}
  piko.edge @a[0] -> @b
  // expected-error@+1 {{expected one edge from port 0 of stage 'a', but got two}}
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{stage 'a' has no input: expected an edge or a source that feeds it}}
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected only state, sources, edges, stages, kernels and a program in a pipeline}}
  %c = arith.constant 0 : i32
}

// -----

piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected a record, but got @F, which is none}}
  piko.constant @c : @F
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected per_source to name one of the 1 sources, but got 1}}
  piko.buffer @b : @F per_source 1
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected the rank of the pipeline, 2, but got 3}}
  piko.image @i : @F rank 3
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected 1 clear values, one for each number of record @F, but got 2}}
  piko.image @i : @F rank 2 clear [1.0 : f32, 2.0 : f32]
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected clear value 0 to be of type 'f32', but got 1 : i32}}
  piko.image @i : @F rank 2 clear [1 : i32]
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected 1 values, one for each number of record @F, but got 2}}
  piko.constant @c : @F value [1.0 : f32, 2.0 : f32]
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected value 0 to be of type 'f32', but got "a"}}
  piko.constant @c : @F value ["a"]
}

// -----

piko.pipeline @P rank 2 {
  // expected-error@+1 {{expected a stage, but got @a, which is none}}
  piko.source @a
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected a stage, but got @b, which is none}}
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected a port below 0, which is how many stage 'a' has, but got 0}}
  piko.edge @a[0] -> @a
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.source @a
  // expected-error@+1 {{expected primitives of record @G, which stage 'b' takes, but port 0 of stage 'a' emits @F}}
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {}
  // expected-note@+1 {{the consumer is declared here}}
  piko.stage @b bins [0, 0] threads 1 : @G -> [] {}
}

// -----

// expected-error@+1 {{expected a positive size, but got 0}}
piko.record @F {} size 0 align 1

// -----

// expected-error@+1 {{expected the alignment to be a power of two that divides the size 12, but got 8}}
piko.record @F {} size 12 align 8

// -----

// expected-error@+1 {{expected each field once, but got 'x' twice}}
piko.record @F {"x" : f32 at 0, "x" : f32 at 4} size 8 align 4

// -----

// expected-error@+1 {{expected field 'y' of type 'f32' to be at a multiple of 4, but got 10}}
piko.record @F {"x" : i32 at 0, "y" : f32 at 10} size 16 align 4

// -----

// expected-error@+1 {{expected an alignment of at least 8, because of field 'x', but got 4}}
piko.record @F {"x" : f64 at 0} size 8 align 4

// -----

// expected-error@+1 {{expected the strides of field 'x' to be multiples of 4, but got 6}}
piko.record @F {"x" : f32[3 : 6] at 0} size 20 align 4

// -----

// expected-error@+1 {{expected field 'y' to lie beside field 'x', but both have byte 4}}
piko.record @F {"x" : i32 at 4, "y" : f32 at 4, "z" : i8 at 0} size 8 align 4

// -----

// A number inside another one.
// expected-error@+1 {{expected field 'b' to lie beside field 'x', but both have byte 6}}
piko.record @F {"b" : i8 at 6, "x" : f32 at 4} size 8 align 4

// -----

// The third number of `x` and the second of `y`.
// expected-error@+1 {{expected field 'y' to lie beside field 'x', but both have byte 16}}
piko.record @F {"x" : f32[3 : 8] at 0, "y" : f32[2 : 12] at 4} size 20 align 4

// -----

// expected-error@+1 {{expected the numbers of field 'x' to lie side by side, but got two at 4}}
piko.record @F {"x" : f32[2 : 4, 2 : 4] at 0} size 16 align 4

// -----

// expected-error@+1 {{attribute 'max_extent' failed to satisfy constraint: 64-bit integer attribute whose value is positive}}
piko.pipeline @P rank 2 max_extent 0 {
}
