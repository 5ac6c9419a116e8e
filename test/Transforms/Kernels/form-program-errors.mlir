// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-form-kernels,piko-form-program))' --split-input-file --verify-diagnostics %s

// A remark for each join that is more than a concatenation.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Remarks rank 1 {
  piko.image @seen_b : @F rank 1
  piko.source @a
  piko.source @b
  // expected-remark @below {{what stage 'a' emits to stage 'b' is permuted: it runs bin by bin, which is not the order of lineage}}
  piko.edge @a[0] -> @b
  piko.stage @a bins [8] threads 1 : @F -> [@F] {
    piko.assign {
    ^bb0(%f: !piko.prim<@F>):
      piko.assign_all
      piko.return
    }
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.emit 0 (%x) : i32
      piko.return
    }
  }
  // expected-remark @below {{what comes to stage 'b' is merged by keys of 2 words: it comes from source 1, stage 'a'}}
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      piko.update @seen_b[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoKernel rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  // expected-error @below {{expected a kernel of stage 'b'}}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
}

// -----

// Only waits can close such a circle.
piko.record @F {"x" : i32 at 0} size 4 align 4
// expected-error @below {{expected waits that can end, but stages wait for each other}}
piko.pipeline @Circle rank 1 {
  piko.source @a
  piko.source @b
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@b]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
  piko.stage @b bins [0] threads 1 : @F -> [] {
    piko.schedule load_balance end_stage [@a]
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      piko.return
    }
  }
}
