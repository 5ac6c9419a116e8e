// RUN: piko-opt --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.buffer @numbers : @F
  piko.source @a
  piko.stage @a bins [16, 16] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %false = arith.constant false
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error @+1 {{'piko.cpu.open_tile' op expected an image, but got @numbers, which is none}}
    %copied = piko.cpu.open_tile @numbers[%c0] of %w for %c0
    piko.cpu.close_tile @numbers of %w if %copied
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.image @seen : @F rank 2
  piko.source @a
  piko.stage @a bins [16, 16] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %false = arith.constant false
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error @+1 {{'piko.cpu.open_tile' op expected it to be closed in its block}}
    %copied = piko.cpu.open_tile @seen[%c0] of %w for %c0
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.source @a
  piko.stage @a bins [16, 16] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %false = arith.constant false
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error @+1 {{'piko.cpu.close_tile' op expected an image, but got @seen, which is none}}
    piko.cpu.close_tile @seen of %w if %false
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4

piko.pipeline @P rank 2 {
  piko.image @seen : @F rank 2
  piko.image @other : @F rank 2
  piko.source @a
  piko.stage @a bins [16, 16] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %w = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %copied = piko.cpu.open_tile @seen[%c0] of %w for %c0
    piko.cpu.close_tile @seen of %w if %copied
    // expected-error @+1 {{'piko.cpu.close_tile' op expected what an open_tile of @other and this writer says}}
    piko.cpu.close_tile @other of %w if %copied
    piko.cpu.close_writer %w
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
