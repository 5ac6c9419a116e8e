// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(convert-piko-to-scf))' --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.image @image : @F rank 1
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {
    piko.process {
    ^bb0(%f: !piko.prim<@F>):
      %x = piko.get %f "x" : !piko.prim<@F> -> i32
      // expected-error @below {{expected loops over units, as piko-form-units makes them}}
      piko.update @image[%x : i32] {
      ^bb0(%old: i32):
        piko.yield [%x : i32]
      }
      piko.return
    }
  }
}

// -----

// Which list it is must be known.
piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : list @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %zero = arith.constant 0 : index
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %some = arith.cmpi sgt, %n, %zero : index
    %all = piko.storage.list %bins[%zero to %n] : !piko.bins<@F> -> !piko.list<@F>
    %none = piko.storage.list %bins[%zero to %zero] : !piko.bins<@F> -> !piko.list<@F>
    %one = arith.select %some, %all, %none : !piko.list<@F>
    // expected-error @below {{expected loops over units, as piko-form-units makes them}}
    %size = piko.list_size %one : !piko.list<@F>
    piko.fail_list @a at %size of %size
  }
}
