// RUN: piko-opt %s --piko-gpu-to-nvvm --convert-gpu-to-cuda | FileCheck %s

// The setup names the images, which are made when the module is translated; a
// launch names the kernel and has its arguments in memory, eight bytes each. Of
// kernels whose stage is known the setup says it.
// CHECK-DAG:   llvm.mlir.global internal constant @k.name("k\00")
// CHECK-DAG:   llvm.mlir.global internal constant @k.stage("draw\00")
// CHECK-DAG:   llvm.mlir.global internal constant @k.place("dots.cpp:17\00")
// CHECK-DAG:   llvm.mlir.global external constant @Dots_gpu.images()
// CHECK-LABEL: func.func @Dots.setup(
// CHECK-SAME:      %[[P:.*]]: !llvm.ptr)
// CHECK:         %[[IMAGES:.*]] = llvm.mlir.addressof @Dots_gpu.images
// CHECK:         llvm.call @pikoir_cuda_module(%[[P]], %[[IMAGES]])
// CHECK:         %[[KERNEL:.*]] = llvm.mlir.addressof @k.name
// CHECK:         %[[STAGE:.*]] = llvm.mlir.addressof @k.stage
// CHECK:         %[[PLACE:.*]] = llvm.mlir.addressof @k.place
// CHECK:         llvm.call @pikoir_cuda_kernel(%[[P]], %[[KERNEL]], %[[STAGE]], %[[PLACE]])
// CHECK-NOT:     pikoir_cuda_kernel
// CHECK-LABEL: func.func @launch(
// CHECK-SAME:      %[[FRAME:.*]]: !llvm.ptr, %[[N:.*]]: index, %[[Q:.*]]: !llvm.ptr, %[[X:.*]]: f32)
// CHECK:         %[[ARGUMENTS:.*]] = llvm.alloca
// CHECK:         llvm.store %[[Q]], %{{.*}} : !llvm.ptr, !llvm.ptr
// CHECK:         %[[SECOND:.*]] = llvm.getelementptr %[[ARGUMENTS]][1]
// CHECK:         llvm.store %[[X]], %[[SECOND]] : f32, !llvm.ptr
// CHECK:         %[[BLOCKS:.*]] = arith.index_cast %[[N]]
// CHECK:         %[[NAME:.*]] = llvm.mlir.addressof @k.name
// CHECK:         %[[COUNT:.*]] = llvm.mlir.constant(2 : i64)
// CHECK:         llvm.call @pikoir_cuda_launch(%[[FRAME]], %[[NAME]], %[[BLOCKS]], %{{.*}}, %[[ARGUMENTS]], %[[COUNT]])
// CHECK-NOT:     gpu.launch_func
// CHECK:       gpu.module @Dots_gpu
// CHECK:         llvm.func @k(
module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) {
    return
  }
  func.func @launch(%frame: !llvm.ptr, %n: index, %p: !llvm.ptr, %x: f32) {
    %one = arith.constant 1 : index
    %t = arith.constant 32 : index
    gpu.launch_func @Dots_gpu::@k blocks in (%n, %one, %one) threads in (%t, %one, %one)
        args(%p : !llvm.ptr, %x : f32)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k(%p: !llvm.ptr, %x: f32) kernel {
      llvm.store %x, %p : f32, !llvm.ptr
      gpu.return
    } loc("draw"("dots.cpp":17:8))
    gpu.func @unknown() kernel {
      gpu.return
    }
  }
}
