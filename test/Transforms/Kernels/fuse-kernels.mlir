// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages,piko-form-kernels,piko-fuse-kernels))' %s | FileCheck %s

piko.record @F {"x" : i32 at 0} size 4 align 4

// A list, and a stage that waits with end_bin for what that one emits, follow in
// one kernel. What leads elsewhere keeps its kernel.
// CHECK-LABEL: piko.pipeline @Chain
// CHECK:         piko.kernel @kernel_a {
// CHECK:           piko.process of @a {
// CHECK:           piko.assign of @b port 0 {
// CHECK:           piko.local_barrier @a[0] -> @b
// CHECK-NEXT:      piko.process of @b {
// CHECK:           piko.assign of @c port 0 {
// CHECK:           piko.assign of @d port 1 {
// CHECK:           piko.local_barrier @b[0] -> @c
// CHECK-NEXT:      piko.process of @c {
// CHECK:         piko.kernel @kernel_d {
// CHECK-NEXT:      piko.process of @d {
// CHECK-NOT:     piko.kernel
piko.pipeline @Chain rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.edge @b[1] -> @d
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.schedule direct_map
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : list @F -> [@F, @F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : i32
      piko.emit 0 (%zero) : i32
      piko.emit 1 (%zero) : i32
      piko.return
    }
  }
  piko.stage @c bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %zero = arith.constant 0 : i32
      %some = arith.cmpi ne, %x, %zero : i32
      scf.if %some {
        piko.assign_previous
      }
      piko.return
    }
    piko.schedule load_balance end_bin
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @d bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// Both update pixels of their bin, one after the other; the wait is for what has
// run before anyway.
// CHECK-LABEL: piko.pipeline @Updates
// CHECK:         piko.kernel @kernel_before {
// CHECK:         piko.local_barrier @a[0] -> @b
// CHECK-NOT:     piko.kernel
piko.pipeline @Updates rank 1 {
  piko.image @image : @F rank 1
  piko.source @before
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @before bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.schedule serialize end_stage [@before]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.schedule serialize end_stage [@before] end_bin
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}
