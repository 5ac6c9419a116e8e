// RUN: piko-opt --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @Number rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{expected a number in [0, 16), but got 16}}
    %0 = piko.cpu.takes_vectors %w {loop = "a", number = 16, scalar = 1, vectors = 1}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @Within rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{expected `within` in [0, 1), but got 1}}
    %0 = piko.cpu.takes_vectors %w {loop = "a", number = 1, scalar = 1, vectors = 1, within = 1}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @Twice rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{expected a number that no other loop of the kernel has, but got 0}}
    %0 = piko.cpu.takes_vectors %w {loop = "a", number = 0, scalar = 1, vectors = 1}
    %1 = piko.cpu.takes_vectors %w {expected, loop = "b", number = 0, scalar = 1, vectors = 1}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
