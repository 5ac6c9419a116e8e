// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s
// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --piko-cpu-to-llvm %s | FileCheck %s --check-prefix=LLVM

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @N {"least" : i64 at 0, "bits" : i32[2 : 4] at 8} size 16 align 8

// What a copy holds in the beginning changes nothing: the greatest number, and in
// the other one ones.
// CHECK-DAG:   llvm.mlir.global internal constant @[[LEAST:.*]]("\FF\FF\FF\FF\FF\FF\FF\7F\00\00\00\00\00\00\00\00\00")
// CHECK-DAG:   llvm.mlir.global internal constant @[[BITS:.*]]("\00\00\00\00\00\00\00\00\FF\FF\FF\FF\FF\FF\FF\FF\00")

// The copy, if there is one, and a note for 32 records of 16 bytes that it has
// changed; or the state, locked.
// CHECK-LABEL: func.func private @P.kernel_a(
// CHECK:         %[[STATE:.*]] = llvm.call @pikoir_get_state
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[COPY:.*]] = llvm.call @pikoir_get_private(%[[W]], %c0_i32)
// CHECK-DAG:     %[[DATA:.*]] = llvm.load %[[COPY]]
// CHECK-DAG:     %[[AT:.*]] = llvm.getelementptr inbounds %[[COPY]][8]
// CHECK-DAG:     %[[DIRTY:.*]] = llvm.load %[[AT]]
// CHECK:         %[[GIVEN:.*]] = llvm.icmp "ne" %[[DATA]],
// CHECK:         scf.if %[[GIVEN]] {
// CHECK:           %[[PLACE:.*]] = llvm.getelementptr inbounds %[[DATA]]
// CHECK:           %[[OLD:.*]] = llvm.load %[[PLACE]]
// CHECK:           %[[NEW:.*]] = arith.minsi %[[OLD]], %[[V:.*]] : i64
// CHECK:           llvm.store %[[NEW]], %[[PLACE]]
// CHECK:           %[[ENTRY:.*]] = arith.shrui %{{.*}}, %c5_i64
// CHECK:           %[[NOTE:.*]] = llvm.getelementptr inbounds %[[DIRTY]][%[[ENTRY]]]
// CHECK:           llvm.store %c1_i8, %[[NOTE]]
// CHECK:         } else {
// CHECK:           llvm.atomicrmw min %{{.*}}, %[[V]] monotonic

// CHECK-LABEL: func.func @P.setup(
// CHECK-DAG:     %[[ID0:.*]] = llvm.mlir.addressof @[[LEAST]]
// CHECK-DAG:     %[[ID1:.*]] = llvm.mlir.addressof @[[BITS]]
// CHECK-DAG:     %[[C0:.*]] = llvm.mlir.addressof @P.combine.a.n.least
// CHECK-DAG:     %[[C1:.*]] = llvm.mlir.addressof @P.combine.a.n.bits
// CHECK:         llvm.call @pikoir_declare_private(%{{.*}}, %c0_i32, %c0_i32, %c0_i32, %[[ID0]], %c5_i32, %c0_i32, %[[C0]])
// CHECK:         llvm.call @pikoir_declare_private(%{{.*}}, %c0_i32, %c1_i32, %c0_i32, %[[ID1]], %c5_i32, %c1_i32, %[[C1]])

// CHECK-LABEL: llvm.func internal @P.combine.a.n.least(
// CHECK-SAME:    %[[TO:.*]]: !llvm.ptr {llvm.noalias}, %[[FROM:.*]]: !llvm.ptr {llvm.noalias}, %[[COUNT:.*]]: i64)
// CHECK:         scf.for
// CHECK-DAG:       %[[A:.*]] = llvm.getelementptr inbounds %[[TO]]
// CHECK-DAG:       %[[B:.*]] = llvm.getelementptr inbounds %[[FROM]]
// CHECK-DAG:       %[[OLD:.*]] = llvm.load %[[A]]
// CHECK-DAG:       %[[MORE:.*]] = llvm.load %[[B]]
// CHECK:           %[[NEW:.*]] = arith.minsi %[[OLD]], %[[MORE]]
// CHECK:           llvm.store %[[NEW]], %[[A]]
// CHECK:           llvm.store %c9223372036854775807_i64, %[[B]]

// CHECK-LABEL: llvm.func internal @P.combine.a.n.bits(
// CHECK:         scf.for
// CHECK:           scf.for
// CHECK:             arith.andi
// CHECK:             llvm.store %c-1_i32

// LLVM-NOT: {{ (scf|arith|piko)\.[a-z]}}
piko.pipeline @P rank 1 {
  piko.buffer @n : @N
  piko.source @a
  piko.stage @a bins [0] threads 1 lineage 0 : @F -> [] {}
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %least = piko.cpu.private_copy min_signed @n "least" of %w
      %bits = piko.cpu.private_copy and @n "bits" of %w often
      %v = arith.index_cast %u : index to i64
      %x = arith.index_cast %u : index to i32
      %one = arith.constant 1 : index
      piko.atomic min_signed checked @n[%u : index] "least", %v in %least : i64
      piko.atomic and checked @n[%u : index] "bits"[%one], %x in %bits : i32
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
