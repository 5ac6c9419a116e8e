// RUN: piko-opt %s --convert-gpu-to-scf --split-input-file --verify-diagnostics

module attributes {gpu.container_module} {
  func.func @host(%blocks: index, %threads: index) {
    %one = arith.constant 1 : index
    // expected-error @below {{expected a grid and blocks of one dimension, and a constant number of threads}}
    gpu.launch_func @kernels::@k blocks in (%blocks, %one, %one) threads in (%threads, %one, %one)
    return
  }
  gpu.module @kernels {
    gpu.func @k() kernel {
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @host(%blocks: index, %memory: memref<?xi32>) {
    %one = arith.constant 1 : index
    %four = arith.constant 4 : index
    gpu.launch_func @kernels::@k blocks in (%blocks, %one, %one) threads in (%four, %one, %one) args(%memory : memref<?xi32>)
    return
  }
  gpu.module @kernels {
    gpu.func @k(%memory: memref<?xi32>) kernel {
      %t = gpu.thread_id x
      // expected-note @below {{the value is from here}}
      %v = memref.load %memory[%t] : memref<?xi32>
      gpu.barrier
      // expected-error @below {{expected no value to live across a barrier, or out of a loop with barriers}}
      memref.store %v, %memory[%t] : memref<?xi32>
      gpu.return
    }
  }
}

// -----

// Threads of a block would wait for others that never come.
module attributes {gpu.container_module} {
  func.func @host(%blocks: index) {
    %one = arith.constant 1 : index
    %four = arith.constant 4 : index
    gpu.launch_func @kernels::@k blocks in (%blocks, %one, %one) threads in (%four, %one, %one)
    return
  }
  gpu.module @kernels {
    gpu.func @k() kernel {
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %t = gpu.thread_id x
      // expected-error @below {{expected a loop with barriers to have the same bounds for all threads}}
      scf.for %i = %zero to %t step %one {
        gpu.barrier
      }
      gpu.return
    }
  }
}

// -----

module attributes {gpu.container_module} {
  func.func @host(%blocks: index) {
    %one = arith.constant 1 : index
    %four = arith.constant 4 : index
    gpu.launch_func @kernels::@k blocks in (%blocks, %one, %one) threads in (%four, %one, %one)
    return
  }
  gpu.module @kernels {
    gpu.func @k() kernel {
      %zero = arith.constant 0 : index
      %b = gpu.block_id x
      %first = arith.cmpi eq, %b, %zero : index
      // expected-error @below {{expected barriers in the kernel's body or in 'scf.for' only}}
      scf.if %first {
        gpu.barrier
      }
      gpu.return
    }
  }
}
