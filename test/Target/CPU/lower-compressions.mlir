// Lanes come to the front by an instruction, or by a permutation that a table says,
// and where there is neither, one after the other.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --pipe P16 --cpu x86-64-v4 | FileCheck %s --check-prefix=AVX512
// RUN: pikoc %s --emit=assembly --pipe P8 --cpu x86-64-v3 | FileCheck %s --check-prefix=AVX2
// RUN: pikoc %s --emit=assembly --pipe P4 --cpu x86-64-v2 | FileCheck %s --check-prefix=SSSE3
// RUN: pikoc %s --emit=assembly --pipe P4 --cpu x86-64 | FileCheck %s --check-prefix=SSE2
// RUN: pikoc %s --emit=assembly --pipe P4 --arch aarch64 | FileCheck %s --check-prefix=NEON

// AVX512:         vpcompressd %zmm
// AVX512-NOT:     vpcompressd {{.*}}(%r
// AVX512-COUNT-2: vpermi2q %zmm
// AVX2:           .Lpiko.compressions.v8(%rip), %[[TABLE:[a-z0-9]+]]
// AVX2:           vpmovzxbd (%[[TABLE]],%{{[a-z0-9]+}},8), %ymm
// AVX2:           vperm{{d|ps}} %ymm
// SSSE3:          pshufb
// SSE2-NOT:       pshufb
// NEON:           .Lpiko.compressions.v4
// NEON:           tbl v{{[0-9]+}}.16b, { v{{[0-9]+}}.16b }, v

piko.record @V {"a" : f32 at 0, "b" : f64 at 8} size 16 align 8

piko.pipeline @P16 rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %all = arith.constant dense<true> : vector<16xi1>
    %zero = arith.constant dense<0.0> : vector<16xf32>
    %order = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]> : vector<16xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<16xindex>] "a" mask %all : vector<16xi1>, vector<16xf32>
      %mask = arith.cmpf olt, %zero, %a : vector<16xf32>
      %1 = piko.cpu.compress %a mask %mask : vector<16xf32>, vector<16xi1>
      piko.cpu.scatter %1, @out[%order : vector<16xindex>] "a" mask %all : vector<16xi1>, vector<16xf32>
      %b = piko.cpu.gather @in[%order : vector<16xindex>] "b" mask %all : vector<16xi1>, vector<16xf64>
      %2 = piko.cpu.compress %b mask %mask : vector<16xf64>, vector<16xi1>
      piko.cpu.scatter %2, @out[%order : vector<16xindex>] "b" mask %all : vector<16xi1>, vector<16xf64>
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

piko.pipeline @P8 rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %all = arith.constant dense<true> : vector<8xi1>
    %zero = arith.constant dense<0.0> : vector<8xf32>
    %order = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<8xindex>] "a" mask %all : vector<8xi1>, vector<8xf32>
      %mask = arith.cmpf olt, %zero, %a : vector<8xf32>
      %1 = piko.cpu.compress %a mask %mask : vector<8xf32>, vector<8xi1>
      piko.cpu.scatter %1, @out[%order : vector<8xindex>] "a" mask %all : vector<8xi1>, vector<8xf32>
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}

piko.pipeline @P4 rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %all = arith.constant dense<true> : vector<4xi1>
    %zero = arith.constant dense<0.0> : vector<4xf32>
    %order = arith.constant dense<[0, 1, 2, 3]> : vector<4xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<4xindex>] "a" mask %all : vector<4xi1>, vector<4xf32>
      %mask = arith.cmpf olt, %zero, %a : vector<4xf32>
      %1 = piko.cpu.compress %a mask %mask : vector<4xf32>, vector<4xi1>
      piko.cpu.scatter %1, @out[%order : vector<4xindex>] "a" mask %all : vector<4xi1>, vector<4xf32>
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
