// With AVX2 a mask stays as a comparison gives it, 32 bits for each lane, also
// where another block takes it: nothing packs it into 16 and unpacks it.
// REQUIRES: x86_64
// RUN: pikoc %s --emit=assembly --cpu x86-64-v3 | FileCheck %s
// CHECK-NOT: vpack
// CHECK:     vmaskmovps {{.*}}, %ymm
// CHECK:     vtestps
// CHECK-NOT: {{vpack|vpmov}}
// CHECK:     vdivps %ymm
// CHECK-NOT: {{vpack|vpmov}}
// CHECK:     vmaskmovps %ymm
// CHECK-NOT: vpack

piko.record @V {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 2 {
  piko.image @depth : @V rank 2
  piko.source @a
  piko.stage @a bins [0, 0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c1 to %n step %c1 {
        %i = arith.index_cast %x : index to i32
        %w = arith.sitofp %i : i32 to f32
        %z = piko.load checked @depth[%x, %c1 : index, index] "z" : f32
        %isNear = arith.cmpf olt, %w, %z : f32
        scf.if %isNear {
          %0 = arith.divf %w, %z : f32
          %1 = arith.divf %0, %z : f32
          %2 = math.sqrt %1 : f32
          piko.store %2, checked @depth[%x, %c1 : index, index] "z" : f32
        }
        %isFar = arith.cmpf ogt, %w, %z : f32
        %far = scf.if %isFar -> f32 {
          %3 = arith.divf %z, %w : f32
          %4 = math.sqrt %3 : f32
          scf.yield %4 : f32
        } else {
          scf.yield %w : f32
        }
        %isNearStill = arith.cmpf olt, %far, %w : f32
        scf.if %isNearStill {
          %5 = arith.divf %far, %z : f32
          %6 = math.sqrt %5 : f32
          scf.if %isNear {
            piko.store %6, checked @depth[%x, %c1 : index, index] "z" : f32
          }
        }
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
