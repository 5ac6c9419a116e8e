// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program,piko-form-work),canonicalize,piko-reduce-by-atomics,canonicalize,cse)' --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "z" : f32 at 4, "n" : i32 at 8} size 12 align 4
piko.record @Z {"z" : f32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @C {"v" : f32[2 : 4] at 0, "w" : i32 at 8} size 12 align 4
piko.record @L {"a" : i64 at 0, "b" : i64 at 8} size 16 align 8

// One word has the key, as a number without sign whose zeros are one, and the
// position. What is carried is computed for the first primitive alone.
// CHECK-LABEL: piko.pipeline @Nearest
// CHECK:         piko.image @depth.first : @piko.first rank 1 clear [-1] internal
// CHECK:         piko.stage @a
// CHECK-NOT:       ordered
// CHECK-SAME:      split
// CHECK:         piko.kernel @kernel_a_first precedes @kernel_a {
// CHECK:           piko.items of @a lanes {{ ?}}items
// CHECK-NOT:         piko.update
// CHECK:             %[[OLD:.*]] = piko.load checked @depth[%{{.*}} : index] "z"
// CHECK:             %[[LESS:.*]] = arith.cmpf olt, %[[Z:.*]], %[[OLD]]
// CHECK:             %[[SUM:.*]] = arith.addf %{{.*}}, %cst
// CHECK:             %[[BITS:.*]] = arith.bitcast %[[SUM]] : f32 to i32
// CHECK:             %[[NEGATIVE:.*]] = arith.shrsi %[[BITS]], %c31_i32
// CHECK:             %[[MASK:.*]] = arith.ori %[[NEGATIVE]], %c-2147483648_i32
// CHECK:             %[[KEY:.*]] = arith.xori %[[BITS]], %[[MASK]]
// CHECK:             %[[WIDE:.*]] = arith.extui %[[KEY]] : i32 to i64
// CHECK:             %[[P:.*]] = piko.position %{{.*}} : !piko.prim<@F>
// CHECK:             %[[POSITION:.*]] = arith.index_castui %[[P]] : index to i64
// CHECK:             %[[HIGH:.*]] = arith.shli %[[WIDE]], %c32_i64
// CHECK:             %[[WORD:.*]] = arith.ori %[[HIGH]], %[[POSITION]]
// CHECK:             %[[THERE:.*]] = piko.load checked @depth.first[%{{.*}} : index] "first"
// CHECK:             %[[BEFORE:.*]] = arith.cmpi ult, %[[WORD]], %[[THERE]]
// CHECK:             %[[BOTH:.*]] = arith.andi %[[LESS]], %[[BEFORE]]
// CHECK:             scf.if %[[BOTH]]
// CHECK-NEXT:          piko.atomic min_unsigned checked @depth.first[%{{.*}} : index] "first", %[[WORD]] : i64
// CHECK-NOT:         @color
// CHECK:             piko.fail @a in %{{.*}} outside bin of @depth
// CHECK:         piko.kernel @kernel_a {
// CHECK-NOT:         piko.update
// CHECK:             arith.cmpi eq
// CHECK:             %[[KEPT:.*]] = arith.andi
// CHECK:             scf.if %[[KEPT]]
// CHECK-NEXT:          piko.store %{{.*}}, checked @depth[%{{.*}} : index] "z"
// CHECK-NOT:           "n"
// CHECK:             scf.if
// CHECK:               piko.store %{{.*}}, checked @color[%{{.*}} : index] "v"[%c0]
// CHECK-NEXT:          piko.store %{{.*}}, checked @color[%{{.*}} : index] "w"
// CHECK:         piko.clear @depth.first
// CHECK-NEXT:    piko.launch @kernel_a(
piko.pipeline @Nearest rank 1 {
  piko.image @depth : @Z rank 1
  piko.image @color : @C rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-remark @below {{stage 'a' finds out by atomic operations which primitive a pixel is of, and then changes: 'depth', 'color'}}
      %nearer = piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %n: i32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new, %n : f32, i32] results [%less : i1]
      } -> i1
      scf.if %nearer {
        piko.update @color[%x : i32] {
        ^bb0(%v: f32, %v1: f32, %w: i32):
          piko.yield [%z, %v1, %x : f32, f32, i32]
        }
      }
      piko.return
    }
  }
}

// Two numbers are a word, the position is another one: the kernels that find the
// least run in this order. The last one among equals has the least.
// CHECK-LABEL: piko.pipeline @Keys
// CHECK:         piko.image @depth.first1
// CHECK:         piko.image @depth.first :
// CHECK:         piko.kernel @kernel_a_first precedes @kernel_a {
// CHECK:           piko.atomic min_unsigned checked @depth.first[
// CHECK:         piko.kernel @kernel_a_first1 precedes @kernel_a {
// CHECK-DAG:         arith.xori %{{.*}}, %c4294967295_i64
// CHECK-DAG:         %[[WORD:.*]] = piko.load checked @depth.first[
// CHECK-DAG:         arith.cmpi eq, %{{.*}}, %[[WORD]]
// CHECK:             piko.atomic min_unsigned checked @depth.first1[
// CHECK:         piko.kernel @kernel_a {
// CHECK-DAG:         piko.load checked @depth.first[
// CHECK-DAG:         piko.load checked @depth.first1[
// CHECK:             piko.store %{{.*}}, checked @depth[%{{.*}} : index] "z"
// CHECK-NEXT:        piko.store %{{.*}}, checked @depth[%{{.*}} : index] "n"
// CHECK:         piko.clear @depth.first, @depth.first1
piko.pipeline @Keys rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      // expected-remark @below {{stage 'a' finds out by atomic operations which primitive a pixel is of, and then changes: 'depth'}}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %less = arith.cmpf ogt, %z, %old : f32
        %equal = arith.cmpf oeq, %z, %old : f32
        %first = arith.cmpi sle, %n, %m : i32
        %both = arith.andi %equal, %first : i1
        %kept = arith.ori %less, %both : i1
        %new = arith.select %kept, %z, %old : f32
        %count = arith.select %kept, %n, %m : i32
        piko.yield [%new, %count : f32, i32]
      }
      piko.return
    }
  }
}

// What it emits, it emits once.
// CHECK-LABEL: piko.pipeline @Emits
// CHECK:         piko.kernel @kernel_a_first precedes @kernel_a {
// CHECK-NOT:       piko.emit
// CHECK-NOT:       piko.place
// CHECK:         piko.kernel @kernel_a {
// CHECK:           piko.emit 0
// CHECK:           piko.place
piko.pipeline @Emits rank 1 {
  piko.image @color : @C rank 1
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      // expected-remark @below {{and then changes: 'color'}}
      piko.update @color[%x : i32] {
      ^bb0(%v: f32, %v1: f32, %w: i32):
        piko.yield [%v, %v1, %x : f32, f32, i32]
      }
      piko.emit 0 (%x, %z, %x) : i32, f32, i32
      piko.return
    }
  }
  piko.stage @b bins [8] threads 1 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}

// Sums of integers need no other kernel.
// CHECK-LABEL: piko.pipeline @Counts
// CHECK:         piko.stage @a
// CHECK-NOT:       ordered
// CHECK-SAME:      split
// CHECK-NOT:     precedes
// CHECK:         piko.atomic add checked @depth[%{{.*}} : index] "n", %{{.*}} : i32
piko.pipeline @Counts rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  // expected-remark @below {{stage 'a' updates pixels of 'depth' in any order, by atomic operations}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %more = arith.addi %m, %x : i32
        piko.yield [%old, %more : f32, i32]
      }
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Wide
// CHECK:         ordered
// CHECK:         piko.update @keys
piko.pipeline @Wide rank 1 {
  piko.image @keys : @L rank 1
  piko.source @a
  // expected-remark @below {{stage 'a' runs its only bin in one block}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      %y = arith.extsi %x : i32 to i64
      %m = arith.extsi %n : i32 to i64
      // expected-note @below {{its key and the position of a primitive take more than two words of 64 bits; let it have fewer or narrower numbers}}
      piko.update @keys[%x : i32] {
      ^bb0(%a: i64, %b: i64):
        %less = arith.cmpi slt, %y, %a : i64
        %equal = arith.cmpi eq, %y, %a : i64
        %first = arith.cmpi slt, %m, %b : i64
        %both = arith.andi %equal, %first : i1
        %kept = arith.ori %less, %both : i1
        %c = arith.select %kept, %y, %a : i64
        %d = arith.select %kept, %m, %b : i64
        piko.yield [%c, %d : i64, i64]
      }
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Reads
// CHECK:         piko.update @depth
piko.pipeline @Reads rank 1 {
  piko.image @depth : @Z rank 1
  piko.buffer @table : @Z
  piko.source @a
  // expected-remark @below {{stage 'a' runs its only bin in one block}}
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      // expected-note @below {{this reads what the stage writes; read what another stage has written}}
      %z = piko.load @table[%x : i32] "z" : f32
      piko.store %n, @table[%x : i32] "n" : i32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new, %m : f32, i32]
      }
      piko.return
    }
  }
}

// On a cycle the pixels of one wave would come before those of the next.
// CHECK-LABEL: piko.pipeline @Again
// CHECK:         piko.update @depth
piko.pipeline @Again rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.edge @a[0] -> @a
  // expected-remark @below {{stage 'a' runs its only bin in one block}}
  // expected-note @below {{it is on a cycle, where primitives of one wave may come before those of another}}
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %z = piko.get %f "z" : !piko.prim<@F> -> f32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %less = arith.cmpf olt, %z, %old : f32
        %new = arith.select %less, %z, %old : f32
        piko.yield [%new, %m : f32, i32]
      }
      piko.emit 0 (%x, %z, %x) : i32, f32, i32
      piko.return
    }
  }
}

// Who asks for one core gets one block.
// CHECK-LABEL: piko.pipeline @Serial
// CHECK:         piko.update @depth
piko.pipeline @Serial rank 1 {
  piko.image @depth : @Z rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule serialize
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32, %m: i32):
        %more = arith.addi %m, %x : i32
        piko.yield [%old, %more : f32, i32]
      }
      piko.return
    }
  }
}
