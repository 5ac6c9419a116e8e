// RUN: piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize %s | FileCheck %s
// RUN: sed 's/units shared/units mapped/' %s | piko-opt --piko-form-program --convert-piko-to-openmp --convert-piko-to-llvm --canonicalize - | FileCheck %s --check-prefix=MAPPED

// A kernel of a cycle may have next to nothing to do. Its units are calls of a
// function, so that it has no parallel region where there is one thread.

piko.record @F {"v" : f32 at 0} size 4 align 4

// The unit has the private array, and what it needs of the kernel.
// CHECK-LABEL: func.func private @P.kernel_a.unit(
// CHECK-SAME:    %[[P:[a-z0-9]+]]: !llvm.ptr{{.*}}, %[[U:[a-z0-9]+]]: index) {
// CHECK:         memref.alloca() : memref<4xf32>
// CHECK:         %[[NUMBER:.*]] = arith.index_cast %[[U]] : index to i64
// CHECK:         llvm.call @pikoir_open(%[[P]], %{{.*}}, %[[NUMBER]])
// CHECK:         llvm.call @pikoir_close
// CHECK:         return

// CHECK-LABEL: func.func private @P.kernel_a(
// CHECK-NOT:     pikoir_open
// CHECK:         %[[THREADS:.*]] = llvm.call @pikoir_threads
// CHECK:         %[[SEVERAL:.*]] = arith.cmpi sgt, %[[THREADS]], %c1_i32
// CHECK:         scf.if %[[SEVERAL]] {
// CHECK-NEXT:      omp.parallel num_threads(%[[THREADS]] : i32) {
// CHECK-NEXT:        scf.if
// CHECK-NEXT:          scf.while
// CHECK:                 llvm.atomicrmw add %{{.*}} monotonic
// CHECK:               ^bb0(%[[I:.*]]: index):
// CHECK-NEXT:            func.call @P.kernel_a.unit({{.*}}, %[[I]])
// CHECK:         } else {
// CHECK-NEXT:      scf.for %[[I:.*]] = %c0 to %{{.*}} step %c1 {
// CHECK-NEXT:        func.call @P.kernel_a.unit({{.*}}, %[[I]])

// MAPPED-LABEL: func.func private @P.kernel_a(
// MAPPED:         omp.parallel
// MAPPED:           llvm.call @pikoir_thread()
// MAPPED:           llvm.call @pikoir_next_unit
// MAPPED:           ^bb0(%[[I:.*]]: index, %{{.*}}: i1):
// MAPPED-NEXT:        func.call @P.kernel_a.unit({{.*}}, %[[I]])

// Outside of cycles a kernel is as it was.
// CHECK-LABEL: func.func private @P.kernel_b(
// CHECK:         omp.parallel
// CHECK:           llvm.atomicrmw add %{{.*}} monotonic
// CHECK:           llvm.call @pikoir_open
// CHECK-NOT:   @P.kernel_b.unit
piko.pipeline @P rank 1 {
  piko.buffer @sums : @F
  piko.source @a
  piko.edge @a[0] -> @a
  piko.edge @a[1] -> @b
  piko.stage @a bins [0] threads 1 lineage 0 : @F -> [@F, @F] {}
  piko.stage @b bins [0] threads 1 lineage 1 : @F -> [] {}
  piko.kernel @kernel_a {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      %array = memref.alloca() : memref<4xf32>
      %zero = arith.constant 0.0 : f32
      memref.store %zero, %array[%u] : memref<4xf32>
      %v = memref.load %array[%units] : memref<4xf32>
      piko.atomic add_float checked @sums[%u : index] "v", %v : f32
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
  piko.kernel @kernel_b {
    %bins = piko.storage.open_bins @b : !piko.bins<@F>
    %units = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%units) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.cpu.close_writer %w
    } {piko.units = #piko<units shared>}
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
