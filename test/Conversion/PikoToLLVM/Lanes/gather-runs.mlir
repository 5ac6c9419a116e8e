// RUN: piko-opt --convert-piko-to-llvm %s | FileCheck %s

piko.record @N {"n" : f32 at 0} size 4 align 4
piko.record @B {"b" : i8 at 0} size 1 align 1

// Places of two lanes are extracted as one number; each lane loads both elements,
// and those that read nothing the first ones.
// CHECK-LABEL: func.func private @P.numbers
// CHECK:         %[[AT:.*]] = arith.select %{{.*}}, %{{.*}}, %{{.*}} : vector<4xi1>, vector<4xi32>
// CHECK:         vector.bitcast %[[AT]] : vector<4xi32> to vector<2xi64>
// CHECK-COUNT-4: llvm.load %{{.*}} {alignment = 4 : i64} : !llvm.ptr -> i64
// CHECK:         vector.shuffle %{{.*}} [0, 2, 4, 6] : vector<8xi32>, vector<8xi32>
// CHECK:         vector.shuffle %{{.*}} [1, 3, 5, 7] : vector<8xi32>, vector<8xi32>
// CHECK-NOT:     gather
//
// Bytes are brought together in one number.
// CHECK-LABEL: func.func private @P.bytes
// CHECK-COUNT-4: llvm.load %{{.*}} {alignment = 1 : i64} : !llvm.ptr -> i8
// CHECK-COUNT-3: arith.shli %{{.*}} : i32
// CHECK:         vector.bitcast %{{.*}} : vector<1xi32> to vector<4xi8>
// They are stored one after the other, without tests if all are.
// CHECK:         %[[ALL:.*]] = vector.reduction <and>
// CHECK-NEXT:    scf.if %[[ALL]] {
// CHECK-COUNT-4:   llvm.store %{{.*}}, %{{.*}} {alignment = 1 : i64} : i8, !llvm.ptr
// CHECK-NEXT:    } else {
// CHECK-NEXT:      llvm.intr.masked.scatter
piko.pipeline @P rank 1 {
  piko.buffer @in : @N
  piko.buffer @raw : @B
  piko.buffer @out : @N
  piko.buffer @copy : @B
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @N -> [] {}
  piko.stage @b bins [0] threads 1 : @N -> [] {}
  piko.kernel @numbers {
    %bins = piko.storage.open_bins @a : !piko.bins<@N>
    %mask = arith.constant dense<[true, true, false, true]> : vector<4xi1>
    %steps = vector.step : vector<4xindex>
    %at = arith.index_cast %steps : vector<4xindex> to vector<4xi32>
    %a, %b = piko.cpu.gather_run @in[%at] "n" mask %mask : vector<4xi32>, vector<4xi1> -> vector<4xf32>, vector<4xf32>
    %sum = arith.addf %a, %b : vector<4xf32>
    piko.cpu.scatter %sum, @out[%steps : vector<4xindex>] "n" mask %mask : vector<4xi1>, vector<4xf32>
    piko.storage.close_bins %bins : !piko.bins<@N>
  }
  piko.kernel @bytes {
    %bins = piko.storage.open_bins @b : !piko.bins<@N>
    %mask = arith.constant dense<true> : vector<4xi1>
    %steps = vector.step : vector<4xindex>
    %a = piko.cpu.gather_run @raw[%steps] "b" mask %mask : vector<4xindex>, vector<4xi1> -> vector<4xi8>
    piko.cpu.scatter %a, @copy[%steps : vector<4xindex>] "b" mask %mask : vector<4xi1>, vector<4xi8>
    %f = arith.uitofp %a : vector<4xi8> to vector<4xf32>
    piko.cpu.scatter %f, @out[%steps : vector<4xindex>] "n" mask %mask : vector<4xi1>, vector<4xf32>
    piko.storage.close_bins %bins : !piko.bins<@N>
  }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@N>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@N>) -> !piko.bins<@N>
    piko.launch @numbers(%1) : (!piko.bins<@N>) -> ()
    %2 = piko.feed 1 : !piko.edge<@N>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@N>) -> !piko.bins<@N>
    piko.launch @bytes(%3) : (!piko.bins<@N>) -> ()
  }
}
