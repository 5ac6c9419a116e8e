// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s
// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu --piko-cpu-to-llvm %s | mlir-translate --mlir-to-llvmir | FileCheck %s --check-prefix=IR

piko.record @F {"x" : i32 at 0, "w" : f32[4 : 4] at 4} size 20 align 4

// Kernels take the runtime's pipeline and give a status back; fields are loads
// at their offsets.
// CHECK-NOT:   {{^ *(%.* = )?piko\.}}
// CHECK-LABEL: func.func private @P.kernel_a(%{{.*}}: !llvm.ptr) -> i32
// CHECK:         llvm.call @pikoir_begin
// CHECK:         omp.parallel
// CHECK:           llvm.call @pikoir_open
// CHECK:           %[[W:.*]] = llvm.load %{{.*}} {{.*}}: !llvm.ptr -> f32
// CHECK:           %[[ROOM:.*]] = llvm.call @pikoir_append
// CHECK:           llvm.store %{{.*}}, %[[ROOM]] {{.*}}: i32
// CHECK:           llvm.store %[[W]]
// CHECK:           llvm.call @pikoir_next
// CHECK:           llvm.call @pikoir_close
// CHECK:         %[[STATUS:.*]] = llvm.call @pikoir_end
// CHECK:         return %[[STATUS]] : i32

// CHECK-LABEL: func.func private @P.kernel_b

// CHECK-LABEL: func.func @P.setup(%{{.*}}: !llvm.ptr)
// CHECK:         llvm.call @pikoir_declare_pipeline
// CHECK:         llvm.call @pikoir_declare_max_extent
// CHECK:         llvm.call @pikoir_declare_stage
// CHECK:         llvm.call @pikoir_declare_edge

// A kernel runs only if the one before it succeeded; here, both for each strip.
// CHECK-LABEL: func.func @P.run(%{{.*}}: !llvm.ptr) -> i32
// CHECK:         %[[A:.*]] = call @P.kernel_a
// CHECK:         %[[FAILED:.*]] = arith.cmpi ne, %[[A]]
// CHECK:         cf.cond_br %[[FAILED]], ^[[STRIPS:.*]], ^[[NEXT:bb[0-9]+]]
// CHECK:       ^[[NEXT]]:
// CHECK:         call @P.kernel_b

// IR: define i32 @P.run(ptr %{{.*}})
piko.pipeline @P rank 2 max_extent 4096 {
  piko.buffer @out : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.schedule load_balance lanes one
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %two = arith.constant 2 : index
      %w = piko.get %f "w"[%two] : !piko.prim<@F> -> f32
      piko.emit 0 (%x, %w, %w, %w, %w) : i32, f32, f32, f32, f32
      piko.return
    }
  }
  piko.stage @b bins [0, 0] threads 1 : @F -> [] {
    piko.schedule load_balance
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %i = arith.index_cast %x : i32 to index
      %two = arith.constant 2 : index
      %w = piko.get %f "w"[%two] : !piko.prim<@F> -> f32
      piko.store %w, @out[%i : index] "w"[%two] : f32
      piko.return
    }
  }
}
