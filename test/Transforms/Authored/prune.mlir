// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-order-stages),piko-prune)' --split-input-file %s | FileCheck %s

// Both `@keep`s take @F, and each gets a record of what it needs. `@through`
// passes "d" on, but nothing reads it at the end; "w" is needed whole.
// CHECK-DAG:   piko.record @F {
// CHECK-DAG:   piko.record @F.through {"a" : f32 at 0, "w" : f32[2 : 4] at 4} size 12 align 4
// CHECK-DAG:   piko.record @F.keep {"a" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Fields
// CHECK:         piko.edge @make[0] -> @through carried 24
// CHECK:         piko.edge @through[0] -> @keep carried 24
// CHECK:         piko.stage @make {{.*}} : @F -> [@F.through]
// CHECK:           %[[A:.*]] = piko.get %{{.*}} "a"
// CHECK-NOT:       "d"
// CHECK:           piko.emit 0(%[[A]], %{{.*}}, %{{.*}}) : f32, f32, f32
// CHECK:         piko.stage @through {{.*}} : @F.through -> [@F.keep]
// CHECK-NOT:       "d"
// CHECK:           piko.emit 0(%{{.*}}) : f32
// CHECK:         piko.stage @keep {{.*}} : list @F.keep -> []
// CHECK:           ^bb0(%[[LIST:.*]]: !piko.list<@F.keep>):
// CHECK:           piko.list_at %[[LIST]][%{{.*}}] : !piko.list<@F.keep> -> !piko.prim<@F.keep>
piko.record @F {"a" : f32 at 0, "d" : f64 at 8, "w" : f32[2 : 4] at 16} size 24 align 8
piko.record @float {"value" : f32 at 0} size 4 align 4
piko.pipeline @Fields rank 1 {
  piko.buffer @out : @float
  piko.source @make
  piko.edge @make[0] -> @through
  piko.edge @through[0] -> @keep
  piko.stage @make bins [0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %d = piko.get %f "d" : !piko.prim<@F> -> f64
      %w0 = piko.get %f "w"[%zero] : !piko.prim<@F> -> f32
      %w1 = piko.get %f "w"[%one] : !piko.prim<@F> -> f32
      piko.emit 0 (%a, %d, %w0, %w1) : f32, f64, f32, f32
      piko.return
    }
  }
  piko.stage @through bins [0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      %d = piko.get %f "d" : !piko.prim<@F> -> f64
      %dd = arith.addf %d, %d : f64
      %w1 = piko.get %f "w"[%one] : !piko.prim<@F> -> f32
      %sum = arith.addf %a, %w1 : f32
      piko.emit 0 (%sum, %dd, %w1, %a) : f32, f64, f32, f32
      piko.return
    }
  }
  piko.stage @keep bins [0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %zero = arith.constant 0 : index
      %f = piko.list_at %list[%zero] : !piko.list<@F> -> !piko.prim<@F>
      %a = piko.get %f "a" : !piko.prim<@F> -> f32
      piko.store %a, @out[%zero : index] "value" : f32
      piko.return
    }
  }
}

// -----

// On a cycle "counted" only feeds itself, but the loop's condition needs "left"
// and the private array what is stored in it. The layout of a source's stage
// stays, so what it does not read is sent as zero.
// CHECK-DAG:   piko.record @P {"counted" : f32 at 0, "left" : i32 at 4, "kept" : f32 at 8} size 12
// CHECK-DAG:   piko.record @P.write {"kept" : f32 at 0} size 4 align 4
// CHECK-LABEL: piko.pipeline @Cycle
// CHECK:         piko.stage @turn {{.*}} : @P -> [@P, @P.write]
// CHECK-NOT:       "counted"
// CHECK:           memref.store
// CHECK:           scf.if
// CHECK:             %[[ANY:.*]] = arith.constant 0.0
// CHECK:             piko.emit 0(%[[ANY]], %{{.*}}, %{{.*}}) : f32, i32, f32
// CHECK:             piko.emit 1(%{{.*}}) : f32
piko.record @P {"counted" : f32 at 0, "left" : i32 at 4, "kept" : f32 at 8} size 12 align 4
piko.record @float {"value" : f32 at 0} size 4 align 4
piko.pipeline @Cycle rank 1 {
  piko.buffer @out : @float
  piko.source @turn
  piko.edge @turn[0] -> @turn
  piko.edge @turn[1] -> @write
  piko.stage @turn bins [0] threads 64 : @P -> [@P, @P] {
    piko.process {
    ^bb0(%p: !piko.prim<@P>):
      %i = arith.constant 0 : index
      %counted = piko.get %p "counted" : !piko.prim<@P> -> f32
      %left = piko.get %p "left" : !piko.prim<@P> -> i32
      %kept = piko.get %p "kept" : !piko.prim<@P> -> f32
      %array = memref.alloca() : memref<2xf32>
      memref.store %kept, %array[%i] : memref<2xf32>
      %same = memref.load %array[%i] : memref<2xf32>
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %goesOn = arith.cmpi sgt, %left, %zero : i32
      scf.if %goesOn {
        %less = arith.subi %left, %one : i32
        %more = arith.addf %counted, %kept : f32
        piko.emit 0 (%more, %less, %same) : f32, i32, f32
      } else {
        piko.emit 1 (%counted, %left, %kept) : f32, i32, f32
      }
      piko.return
    }
  }
  piko.stage @write bins [0] threads 64 : @P -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@P>):
      %i = arith.constant 0 : index
      %kept = piko.get %p "kept" : !piko.prim<@P> -> f32
      piko.store %kept, @out[%i : index] "value" : f32
      piko.return
    }
  }
}

// -----

// What a loop carries for a dead field goes, with the values that only it
// needs; what tells when the loop ends stays.
// CHECK-LABEL: piko.pipeline @Loops
// CHECK:         piko.stage @loop
// CHECK:           %[[N:.*]] = piko.get %{{.*}} "n"
// CHECK-NOT:       "a"
// CHECK:           scf.while
// CHECK:             arith.cmpi slt, %{{.*}}, %[[N]]
// CHECK-NOT:         arith.mulf
// CHECK:             piko.emit 0(%{{.*}}) : i32
piko.record @Q {"n" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @int {"value" : i32 at 0} size 4 align 4
piko.pipeline @Loops rank 1 {
  piko.buffer @out : @int
  piko.source @loop
  piko.edge @loop[0] -> @write
  piko.stage @loop bins [0] threads 64 : @Q -> [@Q] {
    piko.process {
    ^bb0(%p: !piko.prim<@Q>):
      %n = piko.get %p "n" : !piko.prim<@Q> -> i32
      %a = piko.get %p "a" : !piko.prim<@Q> -> f32
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %end:2 = scf.while (%i = %zero, %x = %a) : (i32, f32) -> (i32, f32) {
        %goesOn = arith.cmpi slt, %i, %n : i32
        scf.condition(%goesOn) %i, %x : i32, f32
      } do {
      ^bb0(%i: i32, %x: f32):
        %y = arith.mulf %x, %a : f32
        piko.emit 0 (%i, %y) : i32, f32
        %next = arith.addi %i, %one : i32
        scf.yield %next, %y : i32, f32
      }
      piko.return
    }
  }
  piko.stage @write bins [0] threads 64 : @Q -> [] {
    piko.process {
    ^bb0(%p: !piko.prim<@Q>):
      %i = arith.constant 0 : index
      %n = piko.get %p "n" : !piko.prim<@Q> -> i32
      piko.store %n, @out[%i : index] "value" : i32
      piko.return
    }
  }
}

// -----

// Nothing depends on any field: one byte is left. And all that a bin says of a
// primitive is read where it is assigned.
// CHECK:       piko.record @F.assigned {"x" : i32 at 0} size 4 align 4
// CHECK:       piko.record @F.count {} size 1 align 1
// CHECK-LABEL: piko.pipeline @Reads
// CHECK:           piko.emit 0
// CHECK-NEXT:      piko.emit 1(%{{.*}}) : i32
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @int {"value" : i32 at 0} size 4 align 4
piko.pipeline @Reads rank 1 {
  piko.buffer @out : @int
  piko.source @make
  piko.edge @make[0] -> @count
  piko.edge @make[1] -> @assigned
  piko.stage @make bins [0] threads 64 : @F -> [@F, @F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      piko.emit 0 (%x, %y) : i32, i32
      piko.emit 1 (%x, %y) : i32, i32
      piko.return
    }
  }
  piko.stage @count bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %one = arith.constant 1 : i32
      piko.atomic add @out[%i : index] "value", %one : i32
      piko.return
    }
  }
  piko.stage @assigned bins [8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.assign_box [%x : i32] to [%x : i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 1 : index
      %one = arith.constant 1 : i32
      piko.atomic add @out[%i : index] "value", %one : i32
      piko.return
    }
  }
}

// -----

// All fields are needed, but not the room between them.
// CHECK:       piko.record @F.keep {"a" : i8 at 12, "b" : f64 at 0, "c" : i16[2 : 2] at 8} size 16 align 8
// CHECK-LABEL: piko.pipeline @Compact
piko.record @F {"a" : i8 at 0, "b" : f64 at 8, "c" : i16[2 : 8] at 16} size 32 align 8
piko.record @G {"a" : i8 at 0, "b" : f64 at 8, "c" : i16 at 16} size 24 align 8
piko.pipeline @Compact rank 1 {
  piko.buffer @out : @G
  piko.source @make
  piko.edge @make[0] -> @keep
  piko.stage @make bins [0] threads 64 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> i8
      %b = piko.get %f "b" : !piko.prim<@F> -> f64
      %c = piko.get %f "c"[%i] : !piko.prim<@F> -> i16
      piko.emit 0 (%a, %b, %c, %c) : i8, f64, i16, i16
      piko.return
    }
  }
  piko.stage @keep bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %i = arith.constant 0 : index
      %a = piko.get %f "a" : !piko.prim<@F> -> i8
      %b = piko.get %f "b" : !piko.prim<@F> -> f64
      %c = piko.get %f "c"[%i] : !piko.prim<@F> -> i16
      piko.store %a, @out[%i : index] "a" : i8
      piko.store %b, @out[%i : index] "b" : f64
      piko.store %c, @out[%i : index] "c" : i16
      piko.return
    }
  }
}
