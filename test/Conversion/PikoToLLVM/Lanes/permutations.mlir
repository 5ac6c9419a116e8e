// RUN: piko-opt --piko-to-cpu %s | FileCheck %s

piko.record @V {"a" : f32 at 0, "b" : f64 at 8, "c" : i8 at 16, "d" : i16 at 18} size 24 align 8

// Permutations are calls of functions that move integers of bytes, for the target
// to replace.
// CHECK-DAG:   llvm.func @piko.permute.v16i32(vector<16xi32>, vector<16xi32>) -> vector<16xi32> attributes {memory_effects = #llvm.memory_effects<other = none, {{.*}}>, no_unwind, passthrough = ["speculatable"], will_return}
// CHECK-DAG:   llvm.func @piko.permute.v16i64(vector<16xi64>, vector<16xi32>) -> vector<16xi64>
// CHECK-DAG:   llvm.func @piko.permute.v16i8(vector<16xi8>, vector<16xi32>) -> vector<16xi8>
// CHECK-DAG:   llvm.func @piko.permute.v16i16(vector<16xi16>, vector<16xi32>) -> vector<16xi16>
// CHECK-LABEL: func.func private @P.k(
// CHECK:         %[[FLOATS:.*]] = arith.bitcast %{{.*}} : vector<16xf32> to vector<16xi32>
// CHECK:         llvm.call @piko.permute.v16i32(%[[FLOATS]], %{{.*}}) : (vector<16xi32>, vector<16xi32>) -> vector<16xi32>
// CHECK:         %[[DOUBLES:.*]] = arith.bitcast %{{.*}} : vector<16xf64> to vector<16xi64>
// CHECK:         llvm.call @piko.permute.v16i64(%[[DOUBLES]], %{{.*}})
// CHECK:         llvm.call @piko.permute.v16i8(
// CHECK:         llvm.call @piko.permute.v16i16(
// CHECK:         %[[PLACES:.*]] = arith.index_cast %{{.*}} : vector<16xindex> to vector<16xi64>
// CHECK:         llvm.call @piko.permute.v16i64(%[[PLACES]], %{{.*}})
// CHECK:         %[[BYTES:.*]] = arith.extui %{{.*}} : vector<16xi1> to vector<16xi8>
// CHECK:         %[[MASK:.*]] = llvm.call @piko.permute.v16i8(%[[BYTES]], %{{.*}})
// CHECK:         arith.trunci %[[MASK]] : vector<16xi8> to vector<16xi1>
piko.pipeline @P rank 1 {
  piko.buffer @in : @V
  piko.buffer @out : @V
  piko.source @a
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %all = arith.constant dense<true> : vector<16xi1>
    %order = arith.constant dense<[3, 2, 1, 0, 7, 6, 5, 4, 15, 14, 13, 12, 11, 10, 9, 8]> : vector<16xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@V>
    %n = piko.storage.unit_count %bins : !piko.bins<@V>
    scf.forall (%u) in (%n) {
      %a = piko.cpu.gather @in[%order : vector<16xindex>] "a" mask %all : vector<16xi1>, vector<16xf32>
      %b = piko.cpu.gather @in[%order : vector<16xindex>] "b" mask %all : vector<16xi1>, vector<16xf64>
      %c = piko.cpu.gather @in[%order : vector<16xindex>] "c" mask %all : vector<16xi1>, vector<16xi8>
      %d = piko.cpu.gather @in[%order : vector<16xindex>] "d" mask %all : vector<16xi1>, vector<16xi16>
      %lanes = arith.extsi %c : vector<16xi8> to vector<16xi32>
      %places = arith.index_cast %lanes : vector<16xi32> to vector<16xindex>
      %mask = arith.trunci %c : vector<16xi8> to vector<16xi1>
      %1 = piko.cpu.permute %a[%lanes] : vector<16xf32>, vector<16xi32>
      %2 = piko.cpu.permute %b[%lanes] : vector<16xf64>, vector<16xi32>
      %3 = piko.cpu.permute %c[%lanes] : vector<16xi8>, vector<16xi32>
      %4 = piko.cpu.permute %d[%lanes] : vector<16xi16>, vector<16xi32>
      %5 = piko.cpu.permute %places[%lanes] : vector<16xindex>, vector<16xi32>
      %6 = piko.cpu.permute %mask[%lanes] : vector<16xi1>, vector<16xi32>
      piko.cpu.scatter %1, @out[%order : vector<16xindex>] "a" mask %6 : vector<16xi1>, vector<16xf32>
      piko.cpu.scatter %2, @out[%5 : vector<16xindex>] "b" mask %6 : vector<16xi1>, vector<16xf64>
      piko.cpu.scatter %3, @out[%5 : vector<16xindex>] "c" mask %6 : vector<16xi1>, vector<16xi8>
      piko.cpu.scatter %4, @out[%5 : vector<16xindex>] "d" mask %6 : vector<16xi1>, vector<16xi16>
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@V>
  }
}
