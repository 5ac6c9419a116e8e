// RUN: piko-opt --convert-piko-to-llvm %s | FileCheck %s

piko.record @E {"x" : f32 at 0, "y" : f32 at 4} size 8 align 4

// Elements of a buffer: where all lanes are in the mask, what is loaded and stored
// has none.
// CHECK-LABEL: func.func private @P.copies
// CHECK:         %[[ALL:.*]] = vector.reduction <and>, %[[M:.*]] : vector<16xi1> into i1
// CHECK:         %[[ROWS:.*]]:2 = scf.if %[[ALL]] -> (vector<16xi32>, vector<16xi32>) {
// CHECK-COUNT-2:   llvm.load %{{.*}} {alignment = 4 : i64} : !llvm.ptr -> vector<16xi32>
// CHECK:         } else {
// CHECK-COUNT-2:   llvm.intr.masked.load
// CHECK:         }
// CHECK:         vector.bitcast %[[ROWS]]#0
// CHECK:         scf.if %{{.*}} {
// Of a word that is written alone, the mask is constant.
// CHECK:           %[[WRITTEN:.*]] = arith.constant dense<[true, false, true, false
// CHECK:           llvm.intr.masked.store %{{.*}}, %{{.*}}, %[[WRITTEN]]
// CHECK:         } else {
// CHECK:           arith.andi
piko.pipeline @P rank 1 {
  piko.buffer @in : @E
  piko.buffer @out : @E
  piko.source @a
  piko.stage @a bins [0] threads 1 : @E -> [] {}
  piko.kernel @copies {
    %bins = piko.storage.open_bins @a : !piko.bins<@E>
    %c0 = arith.constant 0 : index
    %count = piko.storage.unit_count %bins : !piko.bins<@E>
    %n = arith.index_cast %count : index to i32
    %ns = vector.broadcast %n : i32 to vector<16xi32>
    %steps = vector.step : vector<16xindex>
    %lanes = arith.index_cast %steps : vector<16xindex> to vector<16xi32>
    %mask = arith.cmpi slt, %lanes, %ns : vector<16xi32>
    %x = piko.cpu.gather consecutive @in[%c0 : index] "x" mask %mask : vector<16xi1>, vector<16xf32>
    piko.cpu.scatter %x, consecutive @out[%c0 : index] "x" mask %mask : vector<16xi1>, vector<16xf32>
    piko.storage.close_bins %bins : !piko.bins<@E>
  }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@E>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@E>) -> !piko.bins<@E>
    piko.launch @copies(%1) : (!piko.bins<@E>) -> ()
  }
}
