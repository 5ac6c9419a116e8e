// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work),canonicalize,cse)' %s | FileCheck %s
// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-work))' %s | piko-opt | FileCheck %s --check-prefix=AGAIN

piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4

// The consumer's assign phase stands after each emission, and says where what
// was emitted goes. Nothing says how many threads there are.
// CHECK-LABEL: piko.pipeline @P
// CHECK:         piko.stage @a {{.*}} split :
// CHECK:         piko.stage @b {{.*}} placed writes :
// CHECK:         piko.kernel @kernel_a
// CHECK:           piko.bins of @a {
// CHECK-NEXT:      ^bb0(%{{.*}}: index):
// CHECK-NEXT:        piko.items of @a {
// CHECK-NEXT:        ^bb0(%[[P:.*]]: !piko.prim<@F>):
// CHECK:               %[[X:.*]] = piko.get %[[P]] "x"
// CHECK:               %[[Y:.*]] = piko.get %[[P]] "y"
// CHECK:               %[[E:.*]] = piko.emit 0(%[[Y]], %[[X]]) : i32, i32 -> !piko.prim<@F>
// The bin of cell (y, x): the assign phase sees what was emitted.
// CHECK:               %[[YI:.*]] = arith.index_cast %[[Y]]
// CHECK:               arith.cmpi ult, %[[YI]]
// CHECK:               arith.divui %[[YI]], %c8
// CHECK:               piko.place %[[E]] of @b in %{{.*}} : !piko.prim<@F>
// CHECK:         piko.kernel @kernel_b
// CHECK:           piko.bins of @b {
// CHECK-NEXT:      ^bb0(%[[BIN:.*]]: index):
// CHECK:             piko.update @image{{.*}} in %[[BIN]]
// CHECK-NOT:     piko.cpu
// AGAIN-LABEL:  piko.pipeline @P
// AGAIN:          piko.place
piko.pipeline @P rank 2 {
  piko.image @image : @F rank 2
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%y, %x) : i32, i32
      piko.return
    }
  }
  piko.stage @b bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %bin = piko.bin_at %x, %y : i32, i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.update @image[%x, %y : i32, i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%b, %a : i32, i32]
      }
      piko.return
    }
  }
}

// Primitives of a source are in no bin. A box becomes loops over the grid, x
// innermost, so that bins come ascending.
// CHECK-LABEL: piko.pipeline @Box
// CHECK:         piko.kernel @source_0_a
// CHECK:           piko.items of @a source 0 {
// CHECK-NEXT:      ^bb0(%[[S:.*]]: !piko.prim<@F>):
// CHECK:             scf.for %[[BY:.*]] =
// CHECK:               scf.for %[[BX:.*]] =
// CHECK:                 arith.addi {{.*}}%[[BX]]
// CHECK:                 piko.place %[[S]] of @a in
piko.pipeline @Box rank 2 {
  piko.source @a
  piko.stage @a bins [8, 8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.assign_box [%x, %x : i32, i32] to [%y, %y : i32, i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// @b takes the list of what @a has emitted in the bin, and @c what @b has.
// CHECK-LABEL: piko.pipeline @Local
// CHECK:         piko.edge @a[0] -> @b local
// CHECK:         piko.edge @b[0] -> @c local
// CHECK:         piko.kernel @kernel_a
// CHECK:           piko.bins of @a {
// CHECK-NEXT:      ^bb0(%[[BIN:.*]]: index):
// CHECK-NEXT:        piko.items of @a {
// CHECK:               %[[E:.*]] = piko.emit 0
// CHECK-NEXT:          piko.place %[[E]] of @b in %[[BIN]]
// CHECK:             piko.lists of @b from @a[0] {
// CHECK-NEXT:        ^bb0(%[[L:.*]]: !piko.list<@F>):
// CHECK-NEXT:          %[[F:.*]] = piko.list_at %[[L]]
// CHECK:               %[[G:.*]] = piko.emit 0
// CHECK-NEXT:          piko.place %[[G]] of @c in %[[BIN]]
// CHECK:             piko.items of @c from @b[0] {
// CHECK:               piko.update @image{{.*}} in %[[BIN]]
piko.pipeline @Local rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @c
  piko.stage @a bins [8] threads 1 : @F -> [@F] {}
  piko.stage @b bins [8] threads 1 : list @F -> [@F] {}
  piko.stage @c bins [8] threads 1 : @F -> [] {
    piko.schedule load_balance end_bin
  }
  piko.kernel @kernel_a {
    piko.process of @a {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      piko.emit 0 (%zero, %zero) : i32, i32
      piko.return
    }
    piko.assign of @b port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.local_barrier @a[0] -> @b
    piko.process of @b {
    ^bb0(%l: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %l[%zero] : !piko.list<@F> -> !piko.prim<@F>
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %x) : i32, i32
      piko.return
    }
    piko.assign of @c port 0 {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_previous
      piko.return
    }
    piko.local_barrier @b[0] -> @c
    piko.process of @c {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @image[%x : i32] {
      ^bb0(%a: i32, %b: i32):
        piko.yield [%x, %x : i32, i32]
      }
      piko.return
    }
  }
}
