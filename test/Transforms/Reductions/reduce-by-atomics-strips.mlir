// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-form-program,piko-form-strips,piko-form-work),canonicalize,piko-reduce-by-atomics)' --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "z" : f32 at 4, "n" : i32 at 8} size 12 align 4
piko.record @Z {"z" : f32 at 0} size 4 align 4

// What strips before have left comes after what a strip selects by its key: the
// words stay.
// CHECK-LABEL: piko.pipeline @Strict
// CHECK:         piko.program
// CHECK:           piko.clear @depth{{$}}
// CHECK:           piko.clear @depth.first
// CHECK-NEXT:      piko.strips
// CHECK-NOT:         piko.clear
// CHECK:             piko.launch @kernel_draw(
// CHECK:             piko.leave
piko.pipeline @Strict rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @split
  piko.edge @split[0] -> @draw
  piko.stage @split bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.emit 0 (%x, %z, %x) : i32, f32, i32
      piko.return
    }
  }
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-remark @below {{stage 'draw' finds out by atomic operations which primitive a pixel is of, and then changes: 'depth'}}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new : f32]
      }
      piko.return
    }
  }
}

// Of equal keys the last is kept: the position in a strip decides in that strip
// alone.
// CHECK-LABEL: piko.pipeline @Last
// CHECK:         piko.program
// CHECK:           piko.clear @depth{{$}}
// CHECK:           piko.strips
// CHECK:             piko.launch @kernel_split
// CHECK:             piko.clear @depth.first
// CHECK-NEXT:        piko.launch @kernel_draw(
// CHECK:             piko.leave
piko.pipeline @Last rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @split
  piko.edge @split[0] -> @draw
  piko.stage @split bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.emit 0 (%x, %z, %x) : i32, f32, i32
      piko.return
    }
  }
  piko.stage @draw bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-remark @below {{stage 'draw' finds out by atomic operations which primitive a pixel is of, and then changes: 'depth'}}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32):
        %less = arith.cmpf ole, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new : f32]
      }
      piko.return
    }
  }
}
