// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-program),piko-reduce-by-atomics,canonicalize,cse)' --verify-diagnostics %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-program),piko-reduce-by-atomics)' %s 2>/dev/null | not piko-opt --piko-to-units 2>&1 | FileCheck %s --check-prefix=CPU
// CPU: error: 'piko.items' op expected work for a CPU: what precedes other work is a GPU's

piko.record @F {"x" : i32 at 0, "z" : f32 at 4, "n" : i32 at 8} size 12 align 4
piko.record @Z {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4

// Threads share what has come along a local edge: work on the same finds out
// what is first, before the work itself.
// CHECK-LABEL: piko.pipeline @Local
// CHECK-NOT:     precedes
// CHECK:         piko.items of @a {
// CHECK:           piko.emit 0
// CHECK:         piko.items of @b from @a[0] lanes {{ ?}}items attributes {piko.again} {
// CHECK:           piko.position
// CHECK:           piko.atomic min_unsigned checked @depth.first
// CHECK-NOT:       piko.store
// CHECK:         piko.items of @b from @a[0] lanes {{ ?}}items {
// CHECK:           piko.store
// CHECK:         piko.clear @depth.first
piko.pipeline @Local rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.edge @a[0] -> @b local
  piko.stage @a bins [8] threads 1 placed : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 ordered writes : @F -> [] {
    piko.schedule load_balance end_bin
  }
  piko.kernel @source_0_a {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = arith.index_cast %x : i32 to index
      piko.place %f of @a in %b : !piko.prim<@F>
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %p = piko.emit 0 (%x, %z, %x) : i32, f32, i32 -> !piko.prim<@F>
        piko.place %p of @b in %bin : !piko.prim<@F>
      }
      piko.items of @b from @a[0] {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        // expected-remark @below {{stage 'b' finds out by atomic operations}}
        piko.update @depth[%x : i32] in %bin {
        ^bb0(%old: f32, %m: i32):
          %less = arith.cmpf olt, %z, %old : f32
          %new = arith.select %less, %z, %old : f32
          piko.yield [%new, %m : f32, i32]
        }
      }
    }
  }
}

// CHECK-LABEL: piko.pipeline @LocalBlend
// CHECK:         piko.update @depth
piko.pipeline @LocalBlend rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.edge @a[0] -> @b local
  piko.stage @a bins [8] threads 1 placed : @F -> [@F] {}
  // expected-remark @below {{stage 'b' runs a bin on one thread}}
  piko.stage @b bins [8] threads 1 ordered writes : @F -> [] {
    piko.schedule load_balance end_bin
  }
  piko.kernel @source_0_a {
    piko.items of @a source 0 {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = arith.index_cast %x : i32 to index
      piko.place %f of @a in %b : !piko.prim<@F>
    }
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        %p = piko.emit 0 (%x, %z, %x) : i32, f32, i32 -> !piko.prim<@F>
        piko.place %p of @b in %bin : !piko.prim<@F>
      }
      piko.items of @b from @a[0] {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        // expected-note @below {{the pixel becomes something that depends on what it was}}
        piko.update @depth[%x : i32] in %bin {
        ^bb0(%old: f32, %m: i32):
          %new = arith.addf %old, %old : f32
          piko.yield [%new, %m : f32, i32]
        }
      }
    }
  }
}

// Two pieces of work on a bin that both change pixels.
// CHECK-LABEL: piko.pipeline @Both
// CHECK-NOT:     piko.again
piko.pipeline @Both rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.edge @a[0] -> @b local
  // expected-remark @below {{stage 'a' runs its only bin in one block}}
  piko.stage @a bins [0] threads 1 ordered writes : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 ordered writes : @F -> [] {
    piko.schedule load_balance end_bin
  }
  piko.kernel @kernel_a {
    piko.bins of @a {
    ^bb0(%bin: index):
      // expected-note @below {{its kernel does other work in the bin, too; give stages that follow it bins of another size}}
      piko.items of @a {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %z = piko.get %f "z" : !piko.prim<@F> -> f32
        piko.update @depth[%x : i32] in %bin {
        ^bb0(%old: f32, %m: i32):
          %less = arith.cmpf olt, %z, %old : f32
          %new = arith.select %less, %z, %old : f32
          piko.yield [%new, %m : f32, i32]
        }
        %p = piko.emit 0 (%x, %z, %x) : i32, f32, i32 -> !piko.prim<@F>
        piko.place %p of @b in %bin : !piko.prim<@F>
      }
      piko.items of @b from @a[0] {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        piko.update @depth[%x : i32] in %bin {
        ^bb0(%old: f32, %m: i32):
          piko.yield [%old, %x : f32, i32]
        }
      }
    }
  }
}
