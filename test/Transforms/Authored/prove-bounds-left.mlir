// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-prove-bounds))' --mlir-print-op-on-diagnostic=false --verify-diagnostics %s

// What looks like a bound and is none.
piko.record @F {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.record @N {"v" : f32 at 0} size 4 align 4

piko.pipeline @Left rank 2 {
  piko.buffer @lights : @N
  piko.image @image : @N rank 2
  piko.source @a
  piko.source @b
  piko.source @c
  piko.stage @a bins [8, 8] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %zero = arith.constant 0 : i32
      %one = arith.constant 1 : i32
      %ones = arith.constant -1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %n = piko.extent @lights[0]
      %n64 = arith.index_cast %n : index to i64
      // All bits are no mask of the lowest.
      %same = arith.andi %x, %ones : i32
      %wide = arith.extsi %same : i32 to i64
      %below = arith.cmpi slt, %wide, %n64 : i64
      scf.if %below {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%same : i32] "v" : f32
      }
      // Of no bin, which is -1, the first cell is before the domain.
      %bin = piko.bin_at %x, %x : i32, i32
      %lo = piko.bin_lo %bin[0]
      %inside = arith.cmpi slt, %lo, %n : index
      scf.if %inside {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%lo : index] "v" : f32
      }
      // A loop over unsigned numbers reaches those that are negative.
      scf.for unsigned %i = %x to %ones step %one : i32 {
        %low = arith.cmpi slt, %i, %zero : i32
        scf.if %low {
          // expected-remark @below {{the index of 'lights' is tested}}
          %l = piko.load @lights[%i : i32] "v" : f32
        }
      }
      piko.return
    }
  }

  // The number of a bin in fewer bits may be that of another one.
  piko.stage @b bins [1, 1] threads 64 : @F -> [] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %y = piko.get %f "y" : !piko.prim<@F> -> i32
      %at = piko.bin_at %x, %y : i32, i32
      %low = arith.index_cast %at : index to i32
      %again = arith.index_cast %low : i32 to index
      %bin = piko.bin
      %same = arith.cmpi eq, %again, %bin : index
      scf.if %same {
        // expected-remark @below {{the index of 'image' is tested}}
        %l = piko.load @image[%x, %y : i32, i32] "v" : f32
      }
      %really = arith.cmpi eq, %at, %bin : index
      scf.if %really {
        %l = piko.load @image[%x, %y : i32, i32] "v" : f32
      }
      piko.return
    }
  }

  // A negative float has no unsigned number.
  piko.stage @c bins [0, 0] threads 64 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %one = arith.constant 1 : i32
      %ones = arith.constant -1 : i32
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      %bit = arith.andi %x, %one : i32
      %negative = arith.subi %ones, %bit : i32
      %float = arith.sitofp %negative : i32 to f32
      %number = arith.fptoui %float : f32 to i32
      %index = arith.subi %ones, %number : i32
      %wide = arith.extsi %index : i32 to i64
      %n = piko.extent @lights[0]
      %n64 = arith.index_cast %n : index to i64
      %below = arith.cmpi slt, %wide, %n64 : i64
      scf.if %below {
        // expected-remark @below {{the index of 'lights' is tested}}
        %l = piko.load @lights[%index : i32] "v" : f32
      }
      piko.return
    }
  }
}
