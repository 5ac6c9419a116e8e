// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize,canonicalize,cse))' %s | FileCheck %s

// A sorted insertion into a short array of each lane. Lanes that are still in
// the loop are at one place, as they began at one: rows, of which the first
// lanes that leave keep what they have. After it they are in different places,
// and each row is written by those that are there.
piko.record @V {"z" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Insert
// CHECK:         %[[ROWS:.*]] = memref.alloca() {alignment = 64 : i64} : memref<64xf32>
// CHECK:         %[[LEFT:.*]]:3 = scf.while (%[[AT:.*]] = %c3, %{{.*}} = %{{.*}}, %[[M:.*]] = %{{.*}}) : (index, vector<16xindex>, vector<16xi1>)
// CHECK:           %[[GOES:.*]] = arith.cmpi sgt, %[[AT]], %c0 : index
// CHECK:           scf.if %[[GOES]] -> (index, vector<16xi1>)
// CHECK:             %[[BEFORE:.*]] = arith.subi %[[AT]], %c1 : index
// CHECK:             %[[ROW:.*]] = arith.muli %[[BEFORE]], %c16 : index
// CHECK:             %[[KEPT:.*]] = vector.load %[[ROWS]][%[[ROW]]]
// CHECK:             arith.cmpf ogt, %[[KEPT]], %{{.*}} : vector<16xf32>
// CHECK-NOT:         vector.{{gather|scatter|masked}}
// CHECK:             vector.store %{{.*}}, %[[ROWS]][%{{.*}}]
// CHECK:             scf.yield %{{.*}}, %{{.*}} : index, vector<16xi1>
// CHECK:           scf.condition(%{{.*}}) %{{.*}} : vector<16xindex>, vector<16xi1>, index
// CHECK:         %[[WORDS:.*]] = arith.index_cast %[[LEFT]]#0 : vector<16xindex> to vector<16xi32>
// CHECK:         %[[IS0:.*]] = arith.cmpi eq, %[[WORDS]], %{{.*}} : vector<16xi32>
// CHECK:         %[[HERE:.*]] = arith.select %{{.*}}, %[[IS0]], %{{.*}} : vector<16xi1>
// CHECK:         %[[OLD:.*]] = vector.load %[[ROWS]][%c0]
// CHECK:         %[[NEW:.*]] = arith.select %[[HERE]], %{{.*}}, %[[OLD]]
// CHECK:         vector.store %[[NEW]], %[[ROWS]][%c0]
// CHECK-COUNT-3: arith.cmpi eq, %[[WORDS]]
// CHECK:         vector.store %{{.*}}, %[[ROWS]][%c48]
// CHECK:         vector.load %[[ROWS]][%c32]
piko.pipeline @Insert rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c2 = arith.constant 2 : index
    %c3 = arith.constant 3 : index
    %false = arith.constant false
    %poison = ub.poison : index
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      scf.for %x = %c0 to %n step %c1 {
        %array = memref.alloca() : memref<4xf32>
        %v = piko.load checked @in[%x : index] "z" : f32
        %w = arith.mulf %v, %v : f32
        memref.store %w, %array[%c0] : memref<4xf32>
        memref.store %v, %array[%c1] : memref<4xf32>
        memref.store %w, %array[%c2] : memref<4xf32>
        %end:2 = scf.while (%at = %c3) : (index) -> (index, index) {
          %goes = arith.cmpi sgt, %at, %c0 : index
          %next:2 = scf.if %goes -> (index, i1) {
            %before = arith.subi %at, %c1 : index
            %kept = memref.load %array[%before] : memref<4xf32>
            %more = arith.cmpf ogt, %kept, %v : f32
            %down = scf.if %more -> index {
              memref.store %kept, %array[%at] : memref<4xf32>
              scf.yield %before : index
            } else {
              scf.yield %poison : index
            }
            scf.yield %down, %more : index, i1
          } else {
            scf.yield %poison, %false : index, i1
          }
          scf.condition(%next#1) %next#0, %at : index, index
        } do {
        ^bb0(%down: index, %at: index):
          scf.yield %down : index
        }
        memref.store %v, %array[%end#1] : memref<4xf32>
        %middle = memref.load %array[%c2] : memref<4xf32>
        piko.store %middle, checked @out[%x : index] "z" : f32
      } {piko.lanes}
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
