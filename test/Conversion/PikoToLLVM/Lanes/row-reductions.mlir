// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s
// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --piko-cpu-to-llvm %s -o /dev/null

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @N {"least" : i64 at 0, "bits" : i32 at 8} size 16 align 8

// Numbers one after the other are loaded and stored as vectors, those of larger
// records gathered and scattered. Notes are from the first lane in the mask to the
// last one; without a copy each lane changes the state, locked.
// CHECK-LABEL: func.func private @P.kernel_a(
// CHECK:         scf.if
// CHECK:           %[[OLD:.*]] = llvm.intr.masked.load %[[AT:.*]], %[[MASK:.*]], %{{.*}} {alignment = 4
// CHECK:           %[[NEW:.*]] = arith.addi %[[OLD]], %{{.*}} : vector<8xi32>
// CHECK:           llvm.intr.masked.store %[[NEW]], %[[AT]], %[[MASK]] {alignment = 4
// CHECK:           scf.if
// CHECK-DAG:         %[[FIRST:.*]] = math.cttz %[[BITS:.*]] : i64
// CHECK-DAG:         %[[REST:.*]] = math.ctlz %[[BITS]] : i64
// CHECK-DAG:         arith.subi %c63_i64, %[[REST]] : i64
// CHECK-COUNT-2:     arith.shrui %{{.*}}, %c7_i64 : i64
// CHECK:             scf.for
// CHECK:               llvm.store %c1_i8
// CHECK:         } else {
// CHECK:           scf.for %{{.*}} = %c0 to %c8 step %c1
// CHECK:             scf.if
// CHECK:               llvm.atomicrmw add %{{.*}}, %{{.*}} monotonic
// CHECK:         scf.if
// CHECK:           %[[OLD:.*]] = llvm.intr.masked.gather
// CHECK:           %[[NEW:.*]] = arith.minsi %[[OLD]], %{{.*}} : vector<8xi64>
// CHECK:           llvm.intr.masked.scatter %[[NEW]]
// CHECK:           llvm.atomicrmw min
piko.pipeline @P rank 1 {
  piko.buffer @f : @F
  piko.buffer @n : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 lineage 0 : @F -> [] {}
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %sum = piko.cpu.private_copy add @f "x" of %w often
      %least = piko.cpu.private_copy min_signed @n "least" of %w
      %number = arith.index_cast %u : index to i32
      %long = arith.index_cast %u : index to i64
      %v = vector.broadcast %number : i32 to vector<8xi32>
      %l = vector.broadcast %long : i64 to vector<8xi64>
      %mask = vector.create_mask %u : vector<8xi1>
      piko.cpu.reduce_row add %v, @f[%u] "x" mask %mask in %sum : vector<8xi1>, vector<8xi32>
      piko.cpu.reduce_row min_signed %l, @n[%u] "least" mask %mask in %least : vector<8xi1>, vector<8xi64>
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
