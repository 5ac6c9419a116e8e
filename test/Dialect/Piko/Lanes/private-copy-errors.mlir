// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"n" : i32 at 0, "m" : i32 at 4, "v" : f32 at 8} size 12 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %c = piko.cpu.private_copy add @b "n" of %w
    // expected-error @below {{expected a private copy for 'add' of @b "m", but got one for 'add' of @b "n"}}
    piko.atomic add @b[%zero : index] "m", %one in %c : i32
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %c = piko.cpu.private_copy xor @b "n" of %w
    // expected-error @below {{expected a private copy for 'or' of @b "n", but got one for 'xor' of @b "n"}}
    piko.atomic or @b[%zero : index] "n", %one in %c : i32
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : i32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %c = piko.cpu.private_copy add @b "n" of %w
    // expected-error @below {{expected no result, because a private copy does not hold what others have changed}}
    %old = piko.atomic add @b[%zero : index] "n", %one in %c : i32 -> i32
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.constant @c : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a buffer or an image, but got @c, which is none}}
    %c = piko.cpu.private_copy add @c "n" of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a field of @F, but got 'm'}}
    %c = piko.cpu.private_copy add @b "m" of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected an operation on integers, whose order does not show, but got 'add_float' of type 'f32'}}
    %c = piko.cpu.private_copy add_float @b "v" of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a source 0 : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected the writer of the stage whose kernel it is, but got that of a source}}
    %c = piko.cpu.private_copy add @b "n" of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] of @a : !piko.bins<@F>
    // expected-error @below {{expected the writer of the stage whose kernel it is, but got that of another stage}}
    %c = piko.cpu.private_copy add @b "n" of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %ones = arith.constant dense<1> : vector<8xi32>
    %mask = arith.constant dense<true> : vector<8xi1>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %c = piko.cpu.private_copy xor @b "n" of %w
    // expected-error @below {{expected a private copy for 'add' of @b "n", but got one for 'xor' of @b "n"}}
    piko.cpu.reduce_row add %ones, @b[%zero] "n" mask %mask in %c : vector<8xi1>, vector<8xi32>
  }
}

// -----

piko.record @F {"n" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @b : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %ones = arith.constant dense<1> : vector<8xi32>
    %mask = arith.constant dense<true> : vector<4xi1>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    %c = piko.cpu.private_copy add @b "n" of %w
    // expected-error @below {{expected a mask of 8 lanes, but got 'vector<4xi1>'}}
    piko.cpu.reduce_row add %ones, @b[%zero] "n" mask %mask in %c : vector<4xi1>, vector<8xi32>
  }
}
