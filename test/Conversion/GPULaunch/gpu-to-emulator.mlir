// RUN: piko-opt %s --piko-gpu-to-nvvm --convert-gpu-to-emulator=seed=9 --split-input-file | FileCheck %s
// RUN: piko-opt %s --piko-gpu-to-nvvm --convert-gpu-to-emulator=blocks=3 --split-input-file | FileCheck %s --check-prefix=FEW

// Arguments go through memory, eight bytes each; the function of a thread is
// made when the module is translated.
// CHECK:       llvm.func @m.k.emulated(!llvm.ptr)
// CHECK-LABEL: func.func @launch(
// CHECK-SAME:      %[[FRAME:.*]]: !llvm.ptr, %[[N:.*]]: index, %[[P:.*]]: !llvm.ptr, %[[X:.*]]: f32)
// CHECK:         %[[ARGUMENTS:.*]] = llvm.alloca
// CHECK:         llvm.store %[[P]], %{{.*}} : !llvm.ptr, !llvm.ptr
// CHECK:         %[[SECOND:.*]] = llvm.getelementptr %[[ARGUMENTS]][1]
// CHECK:         llvm.store %[[X]], %[[SECOND]] : f32, !llvm.ptr
// CHECK-DAG:     %[[THREAD:.*]] = llvm.mlir.addressof @m.k.emulated
// CHECK-DAG:     %[[BLOCKS:.*]] = arith.index_cast %[[N]]
// CHECK-DAG:     %[[SEED:.*]] = llvm.mlir.constant(9 : i64)
// CHECK:         llvm.call @pikoir_grid_launch(%[[FRAME]], %[[THREAD]], %[[BLOCKS]], %{{.*}}, %[[ARGUMENTS]], %[[SEED]])
// CHECK-NOT:     gpu.launch_func
// A grid of fewer blocks, which take one unit after the other.
// FEW-DAG:       %[[ALL:.*]] = arith.index_cast
// FEW-DAG:       %[[MOST:.*]] = arith.constant 3 : i64
// FEW:           %[[BLOCKS:.*]] = arith.minsi %[[ALL]], %[[MOST]]
// FEW:           llvm.call @pikoir_grid_launch(%{{.*}}, %{{.*}}, %[[BLOCKS]],
// CHECK:       gpu.module @m
// CHECK:         llvm.func @k(
module attributes {gpu.container_module} {
  func.func @launch(%frame: !llvm.ptr, %n: index, %p: !llvm.ptr, %x: f32) {
    %one = arith.constant 1 : index
    %t = arith.constant 32 : index
    gpu.launch_func @m::@k blocks in (%n, %one, %one) threads in (%t, %one, %one)
        args(%p : !llvm.ptr, %x : f32)
    return
  }
  gpu.module @m {
    gpu.func @k(%p: !llvm.ptr, %x: f32) kernel {
      llvm.store %x, %p : f32, !llvm.ptr
      gpu.return
    }
  }
}
