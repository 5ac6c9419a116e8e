// RUN: piko-opt %s --convert-gpu-to-cuda --split-input-file --verify-diagnostics

module attributes {gpu.container_module} {
  // expected-error @below {{expected a function 'Dots.setup' beside the kernels}}
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) {
    return
  }
  func.func @launch(%frame: !llvm.ptr, %n: index) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected a grid and blocks of one dimension}}
    gpu.launch_func @Dots_gpu::@k blocks in (%n, %n, %one) threads in (%one, %one, %one)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) attributes {piko.steps = [#piko.step<stage 0 by @launch>]} {
    return
  }
  func.func @launch(%frame: !llvm.ptr) {
    %one = arith.constant 1 : index
    %b = arith.constant true
    %q = llvm.mlir.zero : !llvm.ptr
    cf.br ^next(%q : !llvm.ptr)
  ^next(%a: !llvm.ptr):
    // expected-error @below {{expected arguments that follow from the pipeline's state, but got one that branches carry}}
    gpu.launch_func @Dots_gpu::@k blocks in (%one, %one, %one) threads in (%one, %one, %one)
        args(%a : !llvm.ptr)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k(%p: !llvm.ptr) kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) attributes {piko.steps = [#piko.step<stage 0 by @launch>]} {
    return
  }
  func.func @launch(%frame: !llvm.ptr) {
    %one = arith.constant 1 : index
    %b = arith.constant true
    %q = llvm.mlir.zero : !llvm.ptr
    // expected-note @below {{but got this}}
    %a = scf.if %b -> !llvm.ptr {
      scf.yield %frame : !llvm.ptr
    } else {
      scf.yield %q : !llvm.ptr
    }
    // expected-error @below {{expected arguments that follow from the pipeline's state without branches}}
    gpu.launch_func @Dots_gpu::@k blocks in (%one, %one, %one) threads in (%one, %one, %one)
        args(%a : !llvm.ptr)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k(%p: !llvm.ptr) kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @Dots.setup(%p: !llvm.ptr) attributes {piko.steps = [#piko.step<stage 0 by @launch>]} {
    return
  }
  func.func @launch(%frame: !llvm.ptr, %n: index) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected blocks of a constant size}}
    gpu.launch_func @Dots_gpu::@k blocks in (%one, %one, %one) threads in (%n, %one, %one)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  // expected-error @below {{expected a function @draw, which a step names}}
  func.func @Dots.setup(%p: !llvm.ptr) attributes {piko.steps = [#piko.step<stage 0 by @draw>]} {
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  llvm.func @pikoir_blocks(!llvm.ptr, i32, i32, i64) -> i64
  func.func @Dots.setup(%p: !llvm.ptr) attributes {piko.steps = [#piko.step<stage 0 by @launch>]} {
    return
  }
  func.func @launch(%frame: !llvm.ptr) {
    %one = arith.constant 1 : index
    %zero = arith.constant 0 : i32
    %t = arith.constant 32 : i64
    %n = llvm.call @pikoir_blocks(%frame, %zero, %zero, %t) : (!llvm.ptr, i32, i32, i64) -> i64
    // expected-error @below {{expected arguments that follow from the pipeline's state, but got one of what 'pikoir_blocks' says, which only a run on the host knows}}
    gpu.launch_func @Dots_gpu::@k blocks in (%one, %one, %one) threads in (%one, %one, %one)
        args(%n : i64)
    return
  }
  gpu.module @Dots_gpu {
    gpu.func @k(%n: i64) kernel {
      gpu.return
    }
  }
}
