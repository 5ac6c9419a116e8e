// RUN: piko-opt %s --pass-pipeline='builtin.module(convert-gpu-to-scf,canonicalize)' | FileCheck %s
// RUN: piko-opt %s --pass-pipeline='builtin.module(convert-gpu-to-scf{reverse=true},canonicalize)' | FileCheck %s --check-prefix=REVERSE

// Barriers cut the kernel, and the loop that holds them, into loops over
// threads. What is the same for all threads is computed once; the private array
// has a place for each thread.
// CHECK-LABEL: func.func @host
// CHECK:         scf.for %[[BLOCK:.*]] = %c0 to %[[BLOCKS:.*]] step %c1 {
// CHECK-NEXT:      call @kernels.turn(%[[BLOCK]], %[[BLOCKS]], %{{.*}})

// CHECK-LABEL: func.func private @kernels.turn(
// CHECK-SAME:      %[[B:.*]]: index, %{{.*}}: index, %[[MEMORY:.*]]: memref<?xi32>)
// CHECK:         %[[SHARED:.*]] = memref.alloc() : memref<4xi32>
// CHECK:         %[[PRIVATE:.*]] = memref.alloc() : memref<8xi32>
// CHECK:         %[[N:.*]] = memref.load %[[MEMORY]][%[[B]]]
// CHECK:         %[[COUNT:.*]] = arith.index_cast %[[N]]
// CHECK:         scf.for %[[I:.*]] = %c0 to %[[COUNT]] step %c1 {
// CHECK-NEXT:      %[[J:.*]] = arith.index_cast %[[I]] : index to i32
// CHECK-NEXT:      scf.for %[[T:.*]] = %c0 to %c4 step %c1 {
// CHECK-NEXT:        memref.store %[[J]], %[[SHARED]][%[[T]]]
// CHECK:           }
// CHECK-NEXT:      scf.for %[[T:.*]] = %c0 to %c4 step %c1 {
// CHECK:             %[[OTHER:.*]] = arith.subi %c3, %[[T]]
// CHECK:             memref.load %[[SHARED]][%[[OTHER]]]
// CHECK:             memref.reinterpret_cast %[[PRIVATE]]
// CHECK:           }
// CHECK:         scf.for %[[T:.*]] = %c0 to %c4 step %c1 {
// CHECK:           memref.store %{{.*}}, %[[MEMORY]]
// CHECK:         }
// CHECK-DAG:     memref.dealloc %[[SHARED]]
// CHECK-DAG:     memref.dealloc %[[PRIVATE]]
// CHECK-NOT:   gpu.module

// REVERSE-LABEL: func.func private @kernels.turn(
// REVERSE:         scf.for %[[I:.*]] = %c0 to %c4 step %c1 {
// REVERSE:           %[[T:.*]] = arith.subi %c3, %[[I]]
// REVERSE:           memref.store %{{.*}}, %{{.*}}[%[[T]]]
module attributes {gpu.container_module} {
  func.func @host(%blocks: index, %memory: memref<?xi32>) {
    %one = arith.constant 1 : index
    %four = arith.constant 4 : index
    gpu.launch_func @kernels::@turn blocks in (%blocks, %one, %one) threads in (%four, %one, %one) args(%memory : memref<?xi32>)
    return
  }
  gpu.module @kernels {
    gpu.func @turn(%memory: memref<?xi32>) workgroup(%shared: memref<4xi32, #gpu.address_space<workgroup>>) kernel {
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %three = arith.constant 3 : index
      %b = gpu.block_id x
      %t = gpu.thread_id x
      %array = memref.alloca() : memref<2xi32>
      %n = memref.load %memory[%b] : memref<?xi32>
      %count = arith.index_cast %n : i32 to index
      %other = arith.subi %three, %t : index
      scf.for %i = %zero to %count step %one {
        %j = arith.index_cast %i : index to i32
        memref.store %j, %shared[%t] : memref<4xi32, #gpu.address_space<workgroup>>
        gpu.barrier
        %v = memref.load %shared[%other] : memref<4xi32, #gpu.address_space<workgroup>>
        memref.store %v, %array[%zero] : memref<2xi32>
        gpu.barrier
      }
      %last = memref.load %array[%zero] : memref<2xi32>
      memref.store %last, %memory[%t] : memref<?xi32>
      gpu.return
    }
  }
}
