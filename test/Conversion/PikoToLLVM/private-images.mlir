// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s
// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --piko-cpu-to-llvm %s | FileCheck %s --check-prefix=LLVM

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @Z {"id" : i32 at 0, "z" : f32 at 4} size 8 align 4
piko.record @C {"c" : i16[3 : 2] at 0} size 6 align 2
piko.record @U {"unit" : i32 at 0} size 4 align 4

// All access of the unit goes to its own images; the internal one is no state of
// the pipeline's.
// Numbers, and not bytes: they are aligned.
// CHECK: llvm.mlir.global internal constant @[[ARRAY:piko.array.[0-9]+]](dense<[0, 1]> : tensor<2xi32>)
// CHECK-LABEL: func.func private @P.kernel_a(
// CHECK:         llvm.call @pikoir_get_state
// CHECK-NOT:     llvm.call @pikoir_get_state
// CHECK:         %[[W:.*]] = llvm.call @pikoir_open
// CHECK:         %[[IMAGES:.*]] = llvm.call @pikoir_get_images(%[[W]], %c0_i32)
// CHECK-DAG:     %[[Z:.*]] = llvm.load %[[IMAGES]]
// CHECK-DAG:     %[[CAT:.*]] = llvm.getelementptr inbounds %[[IMAGES]][8]
// CHECK-DAG:     %[[C:.*]] = llvm.load %[[CAT]]
// CHECK-DAG:     %[[UAT:.*]] = llvm.getelementptr inbounds %[[IMAGES]][16]
// CHECK-DAG:     %[[U:.*]] = llvm.load %[[UAT]]
// CHECK:         %[[SHARED:.*]] = llvm.icmp "ne" %[[U]],
// CHECK-DAG:     %[[ZP:.*]] = llvm.getelementptr inbounds %[[Z]]
// CHECK-DAG:     %[[CP:.*]] = llvm.getelementptr inbounds %[[C]]
// CHECK:         scf.if %[[SHARED]] {
// CHECK:           llvm.getelementptr inbounds %[[U]]

// CHECK-LABEL: func.func @P.setup(
// CHECK:         %[[SELECT:.*]] = llvm.mlir.addressof @P.select.a.u
// CHECK:         %[[STATES:.*]] = llvm.mlir.addressof @[[ARRAY]]
// CHECK-COUNT-2: llvm.call @pikoir_declare_state
// CHECK-NOT:     llvm.call @pikoir_declare_state
// CHECK:         llvm.call @pikoir_declare_selection(%{{.*}}, %c0_i32, %c0_i32, %[[STATES]], %c2_i32, %c1_i32, %[[SELECT]])

// CHECK-LABEL: llvm.func internal @P.select.a.u(
// CHECK:         scf.for
// CHECK:           %[[UNIT:.*]] = llvm.load
// CHECK:           arith.cmpi ne, %[[UNIT]], %c-1_i32
// CHECK:           scf.if
// CHECK:             arith.cmpf ogt
// CHECK:             arith.cmpi sgt, %[[UNIT]]
// CHECK:             scf.if
// CHECK-COUNT-3:       llvm.store
// CHECK-NOT:           llvm.store
// CHECK:             }

// LLVM-NOT: {{ (scf|arith|piko)\.[a-z]}}
piko.pipeline @P rank 1 {
  piko.image @z : @Z rank 1
  piko.image @u : @U rank 1 internal
  piko.image @c : @C rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 lineage 0 : @F -> [] {}
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %s = piko.cpu.private_images @z by [1] ["ogt"] last carries [@c] keeps [array<i64: 1>, array<i64: 2>] unit @u of %w often
      %x = arith.index_cast %u : index to i32
      %v = arith.sitofp %x : i32 to f32
      %i = arith.trunci %x : i32 to i16
      %two = arith.constant 2 : index
      piko.store %v, checked @z[%u : index] "z" : f32
      piko.store %i, checked @c[%u : index] "c"[%two] : i16
      scf.if %s {
        piko.store %x, checked @u[%u : index] "unit" : i32
      }
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
