// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu %s | FileCheck %s
// RUN: piko-opt --piko-synthesize --piko-to-machine --piko-to-cpu --piko-cpu-to-llvm %s | mlir-translate --mlir-to-llvmir | FileCheck %s --check-prefix=IR

// Approximations are calls of functions that do nothing but compute, for the
// target to replace.
// CHECK-DAG: llvm.func @piko.approximate_rsqrt.v16f32(vector<16xf32>) -> vector<16xf32> attributes {memory_effects = #llvm.memory_effects<other = none, {{.*}}>, no_unwind, passthrough = ["speculatable"], will_return}
// CHECK-DAG: llvm.func @piko.approximate_reciprocal.v16f32(vector<16xf32>) -> vector<16xf32>
// CHECK-LABEL: func.func private @P.kernel_s
// CHECK:     llvm.call @piko.approximate_rsqrt.v16f32(%{{.*}}) : (vector<16xf32>) -> vector<16xf32>
// CHECK:     llvm.call @piko.approximate_reciprocal.v16f32(%{{.*}}) : (vector<16xf32>) -> vector<16xf32>

// IR: declare <16 x float> @piko.approximate_rsqrt.v16f32(<16 x float>) #[[PURE:[0-9]+]]
// IR: attributes #[[PURE]] = { {{.*}}speculatable willreturn memory(none)

piko.record @F {"x" : f32 at 0, "i" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @F
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance lanes items
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> f32
      %i = piko.get %f "i" : !piko.prim<@F> -> i32
      %r = piko.approximate_rsqrt %x : f32
      %q = piko.approximate_reciprocal %r : f32
      piko.store %q, @out[%i : i32] "x" : f32
      piko.return
    }
  }
}
