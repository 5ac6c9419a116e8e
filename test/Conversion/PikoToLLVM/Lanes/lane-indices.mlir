// RUN: piko-opt --convert-piko-to-llvm %s | FileCheck %s

piko.record @N {"n" : i32 at 0} size 4 align 4
piko.record @B {"b" : i8 at 0} size 1 align 1

// Of an index that cannot overflow, each lane has a part that the loop does not
// change, of 64 bits, and adds what all lanes share.
// CHECK-LABEL: func.func private @P.blocks
// CHECK:         scf.for
// CHECK:           arith.trunci
// CHECK-DAG:       %[[FIRST:.*]] = arith.extsi %{{.*}} : vector<4xi32> to vector<4xi64>
// CHECK-DAG:       %[[ROWS:.*]] = arith.muli %[[FIRST]], %{{.*}} : vector<4xi64>
// CHECK-DAG:       %[[DOWN:.*]] = arith.muli %{{.*}} : i64
// CHECK:           scf.if
// CHECK:             %[[OWN:.*]] = vector.extract %[[ROWS]][0] : i64 from vector<4xi64>
// CHECK:             %[[PLACE:.*]] = llvm.getelementptr %{{.*}}[%[[OWN]]] : (!llvm.ptr, i64) -> !llvm.ptr, i8
// CHECK:             %[[TO:.*]] = llvm.getelementptr %[[PLACE]][%[[DOWN]]] : (!llvm.ptr, i64) -> !llvm.ptr, i8
// CHECK:             llvm.store %{{.*}}, %[[TO]] {alignment = 1 : i64} : i8, !llvm.ptr
//
// One that may wraps around in 32 bits, and stays whole.
// CHECK-LABEL: func.func private @P.wraps
// CHECK:         scf.for
// CHECK-NOT:       arith.extsi
// CHECK:           vector.bitcast %{{.*}} : vector<4xi32> to vector<2xi64>
piko.pipeline @P rank 1 {
  piko.buffer @out : @B
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @N -> [] {}
  piko.stage @b bins [0] threads 1 : @N -> [] {}
  piko.kernel @blocks {
    %bins = piko.storage.open_bins @a : !piko.bins<@N>
    %mask = arith.constant dense<true> : vector<4xi1>
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c8 = arith.constant 8 : index
    %size = piko.storage.unit_count %bins : !piko.bins<@N>
    %width = arith.index_cast %size : index to i32
    %widths = vector.broadcast %width : i32 to vector<4xi32>
    %steps = vector.step : vector<4xindex>
    %first = arith.index_cast %steps : vector<4xindex> to vector<4xi32>
    scf.for %i = %c0 to %c8 step %c1 {
      %v = arith.index_cast %i : index to i32
      %vs = vector.broadcast %v : i32 to vector<4xi32>
      %rows = arith.addi %first, %vs overflow<nsw> : vector<4xi32>
      %at = arith.muli %rows, %widths overflow<nsw> : vector<4xi32>
      %place = arith.index_cast %at : vector<4xi32> to vector<4xindex>
      %b = arith.trunci %vs : vector<4xi32> to vector<4xi8>
      piko.cpu.scatter %b, @out[%place : vector<4xindex>] "b" mask %mask : vector<4xi1>, vector<4xi8>
    }
    piko.storage.close_bins %bins : !piko.bins<@N>
  }
  piko.kernel @wraps {
    %bins = piko.storage.open_bins @b : !piko.bins<@N>
    %mask = arith.constant dense<true> : vector<4xi1>
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c8 = arith.constant 8 : index
    %steps = vector.step : vector<4xindex>
    %first = arith.index_cast %steps : vector<4xindex> to vector<4xi32>
    scf.for %i = %c0 to %c8 step %c1 {
      %v = arith.index_cast %i : index to i32
      %vs = vector.broadcast %v : i32 to vector<4xi32>
      %at = arith.addi %first, %vs : vector<4xi32>
      %place = arith.index_cast %at : vector<4xi32> to vector<4xindex>
      %b = arith.trunci %vs : vector<4xi32> to vector<4xi8>
      piko.cpu.scatter %b, @out[%place : vector<4xindex>] "b" mask %mask : vector<4xi1>, vector<4xi8>
    }
    piko.storage.close_bins %bins : !piko.bins<@N>
  }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@N>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@N>) -> !piko.bins<@N>
    piko.launch @blocks(%1) : (!piko.bins<@N>) -> ()
    %2 = piko.feed 1 : !piko.edge<@N>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@N>) -> !piko.bins<@N>
    piko.launch @wraps(%3) : (!piko.bins<@N>) -> ()
  }
}
