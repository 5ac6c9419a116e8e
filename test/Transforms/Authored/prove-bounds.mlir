// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prove-bounds))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s | FileCheck %s

piko.record @F {"x" : i32 at 0, "n" : i32 at 4} size 8 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

// CHECK-LABEL: piko.pipeline @Proved
piko.pipeline @Proved rank 1 {
  piko.buffer @lights : @N
  piko.image @depth : @N rank 1
  piko.source @counts
  piko.source @conditions
  piko.source @clamps
  piko.source @list

  // Loops from 0 up to the extent, or up to its low bits, which are less.
  piko.stage @counts bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %one = arith.constant 1 : index
      %zero32 = arith.constant 0 : i32
      %one32 = arith.constant 1 : i32
      %n = piko.extent @lights[0]
      %n32 = arith.index_cast %n : index to i32
      // CHECK: scf.for
      // CHECK:   piko.load checked @lights
      scf.for %i = %zero to %n step %one {
        %l = piko.load @lights[%i : index] "v" : f32
      }
      // CHECK: scf.while
      // CHECK:   piko.store %{{.*}}, checked @lights
      %last = scf.while (%i = %zero32) : (i32) -> i32 {
        %more = arith.cmpi slt, %i, %n32 : i32
        scf.condition(%more) %i : i32
      } do {
      ^bb0(%i: i32):
        %v = arith.sitofp %i : i32 to f32
        piko.store %v, @lights[%i : i32] "v" : f32
        %next = arith.addi %i, %one32 : i32
        scf.yield %next : i32
      }
      // for (int64_t i = 0; i < n && i < 9; ++i); also as C++ has it, where the
      // second comparison is a choice.
      // CHECK: scf.while
      // CHECK:   piko.load checked @lights
      %zero64 = arith.constant 0 : i64
      %one64 = arith.constant 1 : i64
      %nine = arith.constant 9 : i64
      %no = arith.constant false
      %n64 = arith.index_cast %n : index to i64
      %both = scf.while (%i = %zero64) : (i64) -> i64 {
        %inside = arith.cmpi slt, %i, %n64 : i64
        %few = arith.cmpi slt, %i, %nine : i64
        %more = arith.andi %few, %inside : i1
        scf.condition(%more) %i : i64
      } do {
      ^bb0(%i: i64):
        %l = piko.load @lights[%i : i64] "v" : f32
        %next = arith.addi %i, %one64 : i64
        scf.yield %next : i64
      }
      // CHECK: scf.while
      // CHECK:   piko.load checked @lights
      %chosen = scf.while (%i = %zero64) : (i64) -> i64 {
        %inside = arith.cmpi slt, %i, %n64 : i64
        %few = arith.cmpi slt, %i, %nine : i64
        %more = arith.select %inside, %few, %no : i1
        scf.condition(%more) %i : i64
      } do {
      ^bb0(%i: i64):
        %l = piko.load @lights[%i : i64] "v" : f32
        %next = arith.addi %i, %one64 : i64
        scf.yield %next : i64
      }
      // CHECK: piko.parallel_for
      // CHECK:   piko.load checked @lights
      piko.parallel_for %n {
      ^bb0(%i: index):
        %l = piko.load @lights[%i : index] "v" : f32
        piko.yield
      }
      piko.return
    }
  }

  // if (x >= 0 && x < n); if (x < 0 || x >= n) return;
  piko.stage @conditions bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %wide = arith.extsi %x : i32 to i64
      %n = piko.extent @lights[0]
      %n64 = arith.index_cast %n : index to i64
      %a = arith.cmpi sge, %x, %zero : i32
      %b = arith.cmpi slt, %wide, %n64 : i64
      %inside = arith.andi %a, %b : i1
      // CHECK: scf.if
      // CHECK:   piko.load checked @lights
      scf.if %inside {
        %l = piko.load @lights[%x : i32] "v" : f32
      }
      %low = arith.cmpi slt, %x, %zero : i32
      %true = arith.constant true
      %high = arith.cmpi sge, %wide, %n64 : i64
      %outside = arith.select %low, %true, %high : i1
      // CHECK: scf.if
      // CHECK: } else {
      // CHECK:   piko.load checked @lights
      scf.if %outside {
      } else {
        %l = piko.load @lights[%x : i32] "v" : f32
      }
      piko.return
    }
  }

  // min(max(x, 0), extent - 1) of an image, which is as large as the domain.
  piko.stage @clamps bins [8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %b = piko.bin_at %x : i32
      piko.assign_to %b
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // The stage's own bin was chosen by x.
      // CHECK: piko.update @depth
      // CHECK: {piko.inside}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32):
        piko.yield [%old : f32]
      }
      // CHECK: piko.load checked @depth
      %d = piko.load @depth[%x : i32] "v" : f32
      piko.return
    }
  }

  piko.stage @list bins [0] threads 64 : list @F -> [] {
    piko.process {
    ^bb0(%list: !piko.list<@F>):
      %one = arith.constant 1 : index
      %zero = arith.constant 0 : index
      %n = piko.list_size %list : !piko.list<@F>
      // CHECK: scf.for
      // CHECK:   piko.list_at checked
      scf.for %i = %zero to %n step %one {
        %p = piko.list_at %list[%i] : !piko.list<@F> -> !piko.prim<@F>
      }
      piko.return
    }
  }
}

// CHECK-LABEL: piko.pipeline @Refused
piko.pipeline @Refused rank 1 {
  piko.buffer @lights : @N
  piko.buffer @others : @N
  piko.image @depth : @N rank 1
  piko.source @counts

  // CHECK-NOT: checked
  // CHECK-NOT: piko.inside
  piko.stage @counts bins [8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.get %f "n" : !piko.prim<@F> -> i32
      piko.assign_box [%x : i32] to [%n : i32]
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : index
      %zero32 = arith.constant 0 : i32
      %minus = arith.constant -1 : index
      %one = arith.constant 1 : index
      %one32 = arith.constant 1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %m = piko.extent @others[0]
      // The extent of another buffer.
      scf.for %i = %zero to %m step %one {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%i : index] "v" : f32
      }
      %n = piko.extent @lights[0]
      // From below 0.
      scf.for %i = %minus to %n step %one {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%i : index] "v" : f32
      }
      // Only one of the bounds.
      %x64 = arith.extsi %x : i32 to i64
      %n64 = arith.index_cast %n : index to i64
      %below = arith.cmpi slt, %x64, %n64 : i64
      scf.if %below {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%x : i32] "v" : f32
      } else {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%x : i32] "v" : f32
      }
      // Either condition is not both.
      %positive = arith.cmpi sge, %x, %zero32 : i32
      %either = arith.ori %below, %positive : i1
      scf.if %either {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%x : i32] "v" : f32
      }
      // One more than what is below.
      scf.for %i = %zero to %n step %one {
        %next = arith.addi %i, %one : index
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%next : index] "v" : f32
      }
      // A count that may wrap around, as its end is not what is compared.
      %last = scf.while (%i = %zero32) : (i32) -> i32 {
        %more = arith.cmpi ne, %i, %x : i32
        scf.condition(%more) %i : i32
      } do {
      ^bb0(%i: i32):
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%i : i32] "v" : f32
        %next = arith.addi %i, %one32 : i32
        scf.yield %next : i32
      }
      // In a list that may be empty, a buffer that may be.
      %c = arith.remui %x64, %n64 : i64
      %c_index = arith.index_cast %c : i64 to index
      // expected-remark @below {{the index of 'lights' is tested}}
      %l = piko.load @lights[%c_index : index] "v" : f32
      // The box may be of other bins, too.
      // expected-remark @below {{the pixel of 'depth' is tested to be in the bin}}
      piko.update @depth[%x : i32] {
      ^bb0(%old: f32):
        piko.yield [%old : f32]
      }
      piko.return
    }
  }
}

// What a size was fixed to: masks, shifts, remainders and clamps are below it.
// CHECK-LABEL: piko.pipeline @Fixed
piko.pipeline @Fixed rank 1 {
  piko.buffer @table : @N
  piko.fixed @table = 512 : index
  piko.source @look
  piko.stage @look bins [0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %mask = arith.constant 511 : i32
      %wide = arith.constant 1023 : i32
      %zero = arith.constant 0 : i32
      %size = arith.constant 512 : i32
      %by = arith.constant 23 : i32
      // CHECK-COUNT-4: piko.load checked @table
      %low = arith.andi %x, %mask : i32
      %a = piko.load @table[%low : i32] "v" : f32
      %high = arith.shrui %x, %by : i32
      %b = piko.load @table[%high : i32] "v" : f32
      %rest = arith.remui %x, %size : i32
      %c = piko.load @table[%rest : i32] "v" : f32
      %least = arith.maxsi %x, %zero : i32
      %most = arith.minsi %least, %mask : i32
      %d = piko.load @table[%most : i32] "v" : f32
      %more = arith.andi %x, %wide : i32
      // expected-remark @below {{the index of 'table' is tested}}
      %e = piko.load @table[%more : i32] "v" : f32
      piko.return
    }
  }
}
