// RUN: piko-opt %s --piko-synthesize --piko-to-machine --piko-to-gpu --split-input-file 2>/dev/null | FileCheck %s
// RUN: piko-opt %s --piko-synthesize --piko-to-machine --piko-to-cpu --split-input-file 2>/dev/null | FileCheck %s --check-prefix=CPU

// Where kernels launch grids the setup has the steps of the program, each kernel
// with what it emits and where that waits. Elsewhere there are none.
// CPU-NOT: piko.steps

piko.record @Ray {"x" : i32 at 0, "left" : i32 at 4} size 8 align 4

// A loop of one stage is entered there; what leaves it does so by one exit.
// CHECK-LABEL: @Waves.setup
// CHECK-SAME:    piko.steps = [#piko.step<clear 0>, #piko.step<strips 0>,
// CHECK-SAME:      #piko.step<waves 0>, #piko.step<exit 1 exit 0>,
// CHECK-SAME:      #piko.step<stage 0 by @Waves.kernel_trace>,
// CHECK-SAME:      #piko.step<queue 0 member 0>, #piko.step<queue 1 exit 0>,
// CHECK-SAME:      #piko.step<end_waves 0>,
// CHECK-SAME:      #piko.step<stage 1 by @Waves.kernel_shade>,
// CHECK-SAME:      #piko.step<end_strips 0>]
piko.pipeline @Waves rank 1 {
  piko.image @count : @Ray rank 1
  piko.source @trace
  piko.edge @trace[0] -> @trace
  piko.edge @trace[1] -> @shade
  piko.stage @trace bins [0] threads 64 : @Ray -> [@Ray, @Ray] {
    piko.process {
    ^bb0(%r: !piko.prim<@Ray>):
      %one = arith.constant 1 : i32
      %x = piko.get %r "x" : !piko.prim<@Ray> -> i32
      %left = piko.get %r "left" : !piko.prim<@Ray> -> i32
      %more = arith.cmpi sgt, %left, %one : i32
      %less = arith.subi %left, %one : i32
      scf.if %more {
        piko.emit 0(%x, %less) : i32, i32
      } else {
        piko.emit 1(%x, %left) : i32, i32
      }
      piko.return
    }
  }
  piko.stage @shade bins [8] threads 64 : @Ray -> [] {
    piko.assign {
    ^bb0(%h: !piko.prim<@Ray>):
      %x = piko.get %h "x" : !piko.prim<@Ray> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%h: !piko.prim<@Ray>):
      %x = piko.get %h "x" : !piko.prim<@Ray> -> i32
      piko.update @count[%x : i32] {
      ^bb0(%a: i32, %b: i32):
        %sum = arith.addi %a, %x : i32
        piko.yield[%sum, %b : i32, i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @Ray {"x" : i32 at 0, "left" : i32 at 4} size 8 align 4

// Primitives come into this loop at both of its stages, and leave it for one
// stage from both.
// CHECK-LABEL: @Entries.setup
// CHECK-SAME:    #piko.step<waves 0>, #piko.step<entry 0 member 0>,
// CHECK-SAME:      #piko.step<entry 1 member 1>, #piko.step<exit 2 exit 0>,
// CHECK-SAME:      #piko.step<stage 0 by @Entries.kernel_a>,
// CHECK-SAME:      #piko.step<queue 0 member 1>, #piko.step<queue 2 exit 0>,
// CHECK-SAME:      #piko.step<stage 1 by @Entries.kernel_b>,
// CHECK-SAME:      #piko.step<queue 1 member 0>, #piko.step<queue 3 exit 0>,
// CHECK-SAME:      #piko.step<end_waves 0>,
piko.pipeline @Entries rank 1 {
  piko.image @count : @Ray rank 1
  piko.source @a
  piko.source @b
  piko.edge @a[0] -> @b
  piko.edge @b[0] -> @a
  piko.edge @a[1] -> @sum
  piko.edge @b[1] -> @sum
  piko.stage @a bins [0] threads 64 : @Ray -> [@Ray, @Ray] {
    piko.process {
    ^bb0(%r: !piko.prim<@Ray>):
      %one = arith.constant 1 : i32
      %x = piko.get %r "x" : !piko.prim<@Ray> -> i32
      %left = piko.get %r "left" : !piko.prim<@Ray> -> i32
      %more = arith.cmpi sgt, %left, %one : i32
      %less = arith.subi %left, %one : i32
      scf.if %more {
        piko.emit 0(%x, %less) : i32, i32
      } else {
        piko.emit 1(%x, %left) : i32, i32
      }
      piko.return
    }
  }
  piko.stage @b bins [0] threads 64 : @Ray -> [@Ray, @Ray] {
    piko.process {
    ^bb0(%r: !piko.prim<@Ray>):
      %two = arith.constant 2 : i32
      %x = piko.get %r "x" : !piko.prim<@Ray> -> i32
      %left = piko.get %r "left" : !piko.prim<@Ray> -> i32
      %more = arith.cmpi sgt, %left, %two : i32
      %less = arith.subi %left, %two : i32
      scf.if %more {
        piko.emit 0(%x, %less) : i32, i32
      } else {
        piko.emit 1(%x, %left) : i32, i32
      }
      piko.return
    }
  }
  piko.stage @sum bins [8] threads 64 : @Ray -> [] {
    piko.assign {
    ^bb0(%h: !piko.prim<@Ray>):
      %x = piko.get %h "x" : !piko.prim<@Ray> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%h: !piko.prim<@Ray>):
      %x = piko.get %h "x" : !piko.prim<@Ray> -> i32
      piko.update @count[%x : i32] {
      ^bb0(%a: i32, %b: i32):
        %sum = arith.addi %a, %x : i32
        piko.yield[%sum, %b : i32, i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @Ray {"x" : i32 at 0, "left" : i32 at 4} size 8 align 4

// What runs between the turns of the stage that collects stands before the
// rounds, and again after its kernel.
// CHECK-LABEL: @Rounds.setup
// CHECK-SAME:    #piko.step<waves 0>, #piko.step<exit 1 exit 0>,
// CHECK-SAME:      #piko.step<stage 0 by @Rounds.kernel_trace>,
// CHECK-SAME:      #piko.step<queue 0 member 0>, #piko.step<queue 1 exit 0>,
// CHECK-SAME:      #piko.step<end_waves 0>,
// CHECK-SAME:      #piko.step<rounds 0>,
// CHECK-SAME:      #piko.step<stage 1 by @Rounds.kernel_shade>, #piko.step<queue 2>,
// CHECK-SAME:      #piko.step<waves 0>, #piko.step<exit 1 exit 0>,
// CHECK-SAME:      #piko.step<stage 0 by @Rounds.kernel_trace>,
// CHECK-SAME:      #piko.step<queue 0 member 0>, #piko.step<queue 1 exit 0>,
// CHECK-SAME:      #piko.step<end_waves 0>,
// CHECK-SAME:      #piko.step<end_rounds 0>]
piko.pipeline @Rounds rank 1 {
  piko.source @trace
  piko.edge @trace[0] -> @trace
  piko.edge @trace[1] -> @shade
  piko.edge @shade[0] -> @trace
  piko.stage @trace bins [0] threads 64 : @Ray -> [@Ray, @Ray] {
    piko.process {
    ^bb0(%r: !piko.prim<@Ray>):
      %one = arith.constant 1 : i32
      %x = piko.get %r "x" : !piko.prim<@Ray> -> i32
      %left = piko.get %r "left" : !piko.prim<@Ray> -> i32
      %more = arith.cmpi sgt, %left, %one : i32
      %less = arith.subi %left, %one : i32
      scf.if %more {
        piko.emit 0(%x, %less) : i32, i32
      } else {
        piko.emit 1(%x, %left) : i32, i32
      }
      piko.return
    }
  }
  piko.stage @shade bins [8] threads 64 : list @Ray -> [@Ray] {
    piko.assign {
    ^bb0(%h: !piko.prim<@Ray>):
      %x = piko.get %h "x" : !piko.prim<@Ray> -> i32
      %bin = piko.bin_at %x : i32
      piko.assign_to %bin
      piko.return
    }
    piko.process {
    ^bb0(%l: !piko.list<@Ray>):
      %zero = arith.constant 0 : i32
      piko.emit 0(%zero, %zero) : i32, i32
      piko.return
    }
  }
}
