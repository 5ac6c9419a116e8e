// Rows of bytes have no masked loads or stores below AVX-512: where all lanes take
// part, which a branch asks, they are plain ones, and else lane by lane.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --cpu x86-64-v3 | FileCheck %s
// RUN: pikoc %s --emit=assembly --cpu x86-64-v4 | FileCheck %s --check-prefix=MASKS
// CHECK:     vpmovzxbd (%{{.*}}), %ymm
// CHECK:     vtestps
// CHECK:     vmovq %xmm{{[0-9]+}}, (%
// CHECK:     vpextrb $0, %xmm{{[0-9]+}}, (%
// MASKS-NOT: vpinsrb
// MASKS:     vmovdqu8 {{.*}}{%k
// MASKS-NOT: vpinsrb

piko.record @V {"z" : i8 at 0} size 1 align 1
piko.pipeline @P rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c1 to %n step %c1 {
        %v = piko.load checked @in[%x : index] "z" : i8
        %i = arith.index_cast %x : index to i32
        %f = arith.sitofp %i : i32 to f32
        %w = arith.extui %v : i8 to i32
        %g = arith.sitofp %w : i32 to f32
        %is_less = arith.cmpf olt, %g, %f : f32
        scf.if %is_less {
          %q = arith.divf %f, %g : f32
          %r = math.sqrt %q : f32
          %s = arith.divf %r, %g : f32
          %t = math.sqrt %s : f32
          %o = arith.fptoui %t : f32 to i8
          piko.store %o, checked @out[%x : index] "z" : i8
        }
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
