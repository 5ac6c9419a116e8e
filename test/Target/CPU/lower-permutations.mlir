// A permutation of lanes is an instruction where there is one for that many, and
// otherwise goes through memory, on the stack.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --pipe P16 --cpu x86-64-v4 | FileCheck %s --check-prefix=AVX512
// RUN: pikoc %s --emit=assembly --pipe P8 --cpu x86-64-v3 | FileCheck %s --check-prefix=AVX2
// RUN: pikoc %s --emit=assembly --pipe P4 --cpu x86-64-v3 | FileCheck %s --check-prefix=AVX
// RUN: pikoc %s --emit=assembly --pipe P4 --cpu x86-64-v2 | FileCheck %s --check-prefix=SSSE3
// RUN: pikoc %s --emit=assembly --pipe P4 --cpu x86-64 | FileCheck %s --check-prefix=SSE2
// RUN: pikoc %s --emit=assembly --pipe P16 --cpu x86-64-v3 | FileCheck %s --check-prefix=WIDE
// RUN: pikoc %s --emit=assembly --pipe P4 --arch aarch64 | FileCheck %s --check-prefix=NEON

// Of 64 bits an instruction takes two registers, or they move as halves.
// AVX512:         vpermd %zmm
// AVX512-COUNT-2: vpermi2q %zmm
// AVX2:          vperm{{d|ps}} %ymm
// AVX2-NOT:      vperm{{d|ps}}
// AVX2:          vpermpd $216
// AVX2:          vperm{{d|ps}} %ymm
// AVX2:          vperm{{d|ps}} %ymm
// AVX-COUNT-3:   vpermilps %xmm{{.*}}, %xmm{{.*}}, %xmm
// SSSE3-COUNT-4: pshufb
// NEON-COUNT-3:  tbl v{{[0-9]+}}.16b, { v{{[0-9]+}}.16b }, v
// SSE2-COUNT-8:  (%rsp,%r{{[a-z0-9]+}},{{[48]}}), %xmm
// WIDE-COUNT-8:  (%rsp,%r{{[a-z0-9]+}},{{[48]}})

piko.record @V {"a" : f32 at 0, "lane" : i32 at 4, "b" : f64 at 8} size 16 align 8

piko.pipeline @P16 rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %all = arith.constant dense<true> : vector<16xi1>
    %order = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]> : vector<16xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<16xindex>] "a" mask %all : vector<16xi1>, vector<16xf32>
      %b = piko.cpu.gather @in[%order : vector<16xindex>] "b" mask %all : vector<16xi1>, vector<16xf64>
      %lanes = piko.cpu.gather @in[%order : vector<16xindex>] "lane" mask %all : vector<16xi1>, vector<16xi32>
      %1 = piko.cpu.permute %a[%lanes] : vector<16xf32>, vector<16xi32>
      %2 = piko.cpu.permute %b[%lanes] : vector<16xf64>, vector<16xi32>
      piko.cpu.scatter %1, @out[%order : vector<16xindex>] "a" mask %all : vector<16xi1>, vector<16xf32>
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
    %order = arith.constant dense<[0, 1, 2, 3, 4, 5, 6, 7]> : vector<8xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<8xindex>] "a" mask %all : vector<8xi1>, vector<8xf32>
      %b = piko.cpu.gather @in[%order : vector<8xindex>] "b" mask %all : vector<8xi1>, vector<8xf64>
      %lanes = piko.cpu.gather @in[%order : vector<8xindex>] "lane" mask %all : vector<8xi1>, vector<8xi32>
      %1 = piko.cpu.permute %a[%lanes] : vector<8xf32>, vector<8xi32>
      %2 = piko.cpu.permute %b[%lanes] : vector<8xf64>, vector<8xi32>
      piko.cpu.scatter %1, @out[%order : vector<8xindex>] "a" mask %all : vector<8xi1>, vector<8xf32>
      piko.cpu.scatter %2, @out[%order : vector<8xindex>] "b" mask %all : vector<8xi1>, vector<8xf64>
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
    %order = arith.constant dense<[0, 1, 2, 3]> : vector<4xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<4xindex>] "a" mask %all : vector<4xi1>, vector<4xf32>
      %b = piko.cpu.gather @in[%order : vector<4xindex>] "b" mask %all : vector<4xi1>, vector<4xf64>
      %lanes = piko.cpu.gather @in[%order : vector<4xindex>] "lane" mask %all : vector<4xi1>, vector<4xi32>
      %1 = piko.cpu.permute %a[%lanes] : vector<4xf32>, vector<4xi32>
      %2 = piko.cpu.permute %b[%lanes] : vector<4xf64>, vector<4xi32>
      piko.cpu.scatter %1, @out[%order : vector<4xindex>] "a" mask %all : vector<4xi1>, vector<4xf32>
      piko.cpu.scatter %2, @out[%order : vector<4xindex>] "b" mask %all : vector<4xi1>, vector<4xf64>
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
