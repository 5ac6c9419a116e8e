// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work,piko-form-units,piko-privatize),canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

// What shows the order of changes, or may see one of another thread, stays as it
// is: in place and locked.

piko.record @F {"x" : i32 at 0, "v" : f32 at 4} size 8 align 4
piko.record @N {"n" : i32 at 0, "v" : f32 at 4} size 8 align 4

// CHECK-LABEL: piko.pipeline @P
// CHECK-NOT:     private_copy
piko.pipeline @P rank 1 {
  piko.buffer @places : @N
  piko.buffer @sums : @N
  piko.buffer @both : @N
  piko.buffer @seen : @N
  piko.buffer @stored : @N
  piko.image @pixels : @N rank 1
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance unordered
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %v = piko.get %f "v" : !piko.prim<@F> -> f32
      // expected-remark @below {{stage 'a' changes 'places' by locked instructions}}
      // expected-note @below {{the result of this is used}}
      %old = piko.atomic add @places[%x : i32] "n", %x : i32 -> i32
      piko.store %v, @seen[%old : i32] "v" : f32
      // expected-remark @below {{stage 'a' changes 'sums' by locked instructions}}
      // expected-note @below {{sums of floats depend on the order in which they are added}}
      piko.atomic add_float @sums[%x : i32] "v", %v : f32
      // expected-remark @below {{stage 'a' changes 'both' by locked instructions}}
      piko.atomic add @both[%x : i32] "n", %x : i32
      // expected-note @below {{this is an operation of another kind}}
      piko.atomic max_signed @both[%x : i32] "n", %x : i32
      // expected-remark @below {{stage 'a' changes 'seen' by locked instructions}}
      piko.atomic or @seen[%x : i32] "n", %x : i32
      // expected-note @below {{this uses it, too}}
      %n = piko.load @seen[%x : i32] "n" : i32
      // expected-remark @below {{stage 'a' changes 'stored' by locked instructions}}
      piko.atomic and @stored[%n : i32] "n", %x : i32
      // expected-note @below {{this uses it, too}}
      piko.store %x, @stored[%x : i32] "n" : i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-remark @below {{stage 'b' changes 'pixels' by locked instructions}}
      piko.atomic add @pixels[%x : i32] "n", %x : i32
      // expected-note @below {{this uses it, too}}
      piko.update @pixels[%x : i32] {
      ^bb0(%n: i32, %v: f32):
        piko.yield [%x, %v : i32, f32]
      }
      piko.return
    }
  }
}
