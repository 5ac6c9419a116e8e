// RUN: piko-opt %s --piko-gpu-to-nvvm --convert-gpu-to-cuda --split-input-file | FileCheck %s
// RUN: piko-opt %s --piko-gpu-to-nvvm --convert-gpu-to-emulator --split-input-file | FileCheck %s --check-prefix=EMULATOR

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

// -----

// The steps of a program become a table, which the setup gives to the runtime.
// The grids of a kernel are an array that ends with zeros; a function of each
// computes the arguments, of the input and the log that it is given. What the host
// calls has an address by a function around it.
// EMULATOR-LABEL: func.func @Lines.setup(
// EMULATOR-NOT:     piko.steps
// EMULATOR-NOT:     pikoir_cuda_program
// CHECK-LABEL: func.func @Lines.setup(
// CHECK-SAME:      %[[P:.*]]: !llvm.ptr) {
// CHECK:         %[[TABLE:.*]] = llvm.mlir.addressof @Lines.steps
// CHECK:         %[[COUNT:.*]] = llvm.mlir.constant(4 : i64)
// CHECK:         llvm.call @pikoir_cuda_program(%[[P]], %[[TABLE]], %[[COUNT]])
// CHECK-LABEL: func.func private @Lines.draw(
// CHECK-COUNT-2: llvm.call @pikoir_cuda_launch(
// CHECK-LABEL: llvm.func internal @Lines.decide.host(
// CHECK-SAME:      %[[Q:.*]]: !llvm.ptr) -> i32
// CHECK:         func.call @Lines.decide(%[[Q]])
// CHECK-LABEL: llvm.func internal @Lines.draw.arguments0(
// CHECK-SAME:      %[[Q:.*]]: !llvm.ptr, %[[INPUT:.*]]: !llvm.ptr, %[[LOG:.*]]: !llvm.ptr, %[[WORDS:.*]]: !llvm.ptr)
// CHECK:         %[[STATE:.*]] = llvm.call @pikoir_get_state(%[[Q]], %{{.*}})
// CHECK:         %[[DATA:.*]] = llvm.load %[[STATE]]
// CHECK-NOT:     pikoir_begin
// CHECK:         llvm.store %[[INPUT]], %{{.*}}
// CHECK:         llvm.store %[[LOG]], %{{.*}}
// CHECK:         llvm.store %[[DATA]], %{{.*}}
// CHECK:         llvm.return
// CHECK-LABEL: llvm.func internal @Lines.draw.arguments1(
// CHECK-NOT:     pikoir_get_state
// CHECK:         llvm.return
// CHECK-LABEL: llvm.mlir.global internal constant @Lines.draw.grids() {{.*}} !llvm.array<3 x struct<(ptr, i64, i64, ptr)>>
// CHECK-DAG:     llvm.mlir.addressof @k.name
// CHECK-DAG:     llvm.mlir.constant(64 : i64)
// CHECK-DAG:     llvm.mlir.addressof @Lines.draw.arguments0
// CHECK-DAG:     llvm.mlir.addressof @rest.name
// CHECK-DAG:     llvm.mlir.addressof @Lines.draw.arguments1
// CHECK:         llvm.return
// CHECK-LABEL: llvm.mlir.global internal constant @Lines.steps() {{.*}} !llvm.array<4 x struct<(i32, i32, i32, i32, ptr, ptr)>>
// CHECK:         llvm.mlir.addressof @Lines.draw.grids
module attributes {gpu.container_module} {
  llvm.func @pikoir_get_state(!llvm.ptr, i32) -> !llvm.ptr
  llvm.func @pikoir_begin(!llvm.ptr, i32) -> !llvm.ptr
  llvm.func @pikoir_log_open(!llvm.ptr, i32, i32) -> !llvm.ptr
  func.func @Lines.setup(%p: !llvm.ptr) attributes {piko.steps = [
      #piko.step<host 0 by @Lines.decide>, #piko.step<clear 1>, #piko.step<stage 0 by @Lines.draw>, #piko.step<queue 0 exit 0>]} {
    return
  }
  func.func private @Lines.decide(%frame: !llvm.ptr) -> i32 {
    %zero = arith.constant 0 : i32
    return %zero : i32
  }
  func.func private @Lines.draw(%frame: !llvm.ptr) {
    %zero = arith.constant 0 : i32
    %one = arith.constant 1 : index
    %t = arith.constant 64 : index
    %state = llvm.call @pikoir_get_state(%frame, %zero) : (!llvm.ptr, i32) -> !llvm.ptr
    %data = llvm.load %state : !llvm.ptr -> !llvm.ptr
    %input = llvm.call @pikoir_begin(%frame, %zero) : (!llvm.ptr, i32) -> !llvm.ptr
    %log = llvm.call @pikoir_log_open(%frame, %zero, %zero) : (!llvm.ptr, i32, i32) -> !llvm.ptr
    gpu.launch_func @Lines_gpu::@k blocks in (%one, %one, %one) threads in (%t, %one, %one)
        args(%input : !llvm.ptr, %log : !llvm.ptr, %data : !llvm.ptr)
    gpu.launch_func @Lines_gpu::@rest blocks in (%one, %one, %one) threads in (%t, %one, %one)
        args(%log : !llvm.ptr)
    return
  }
  gpu.module @Lines_gpu {
    gpu.func @k(%input: !llvm.ptr, %log: !llvm.ptr, %data: !llvm.ptr) kernel {
      gpu.return
    }
    gpu.func @rest(%log: !llvm.ptr) kernel {
      gpu.return
    }
  }
}
