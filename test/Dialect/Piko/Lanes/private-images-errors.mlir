// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected an internal image of one i32, but got @u}}
    %s = piko.cpu.private_images @z by [0] ["slt"] carries [] keeps [array<i64: 0>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @c : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected the numbers kept of 2 images, but got those of 1}}
    %s = piko.cpu.private_images @z by [0] ["slt"] carries [@c] keeps [array<i64: 0>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected numbers of @F, but got 2}}
    %s = piko.cpu.private_images @z by [0] ["slt"] carries [] keeps [array<i64: 0, 2>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected an image, and not that of units, but got @u}}
    %s = piko.cpu.private_images @z by [0] ["slt"] carries [@u] keeps [array<i64: 0>, array<i64: 0>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a comparison for each number of a key}}
    %s = piko.cpu.private_images @z by [0, 1] ["slt"] carries [] keeps [array<i64: 0, 1>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a key of numbers that are kept, but got 1}}
    %s = piko.cpu.private_images @z by [1] ["olt"] carries [] keeps [array<i64: 0>] unit @u of %w
  }
}

// -----

piko.record @F {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @U {"unit" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @z : @F rank 1
  piko.image @u : @U rank 1 internal
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %zero = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%zero] : !piko.bins<@F>
    // expected-error @below {{expected a strict comparison of 'f32', but got "ole"}}
    %s = piko.cpu.private_images @z by [1] ["ole"] carries [] keeps [array<i64: 1>] unit @u of %w
  }
}
