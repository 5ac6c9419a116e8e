// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-vectorize))' --split-input-file --verify-diagnostics %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @Lanes rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-error@+1 {{expected a plan of 4, 8, 16 or 32 lanes, but got 12}}
      scf.for %x = %c1 to %n step %c1 {
      } {piko.lanes, piko.vector_lanes = 12}
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @OtherLoop rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-error@+1 {{expected a plan of an scf.for, but this is scf.while}}
      %x = scf.while (%i = %c1) : (index) -> index {
        %more = arith.cmpi slt, %i, %n : index
        scf.condition(%more) %i : index
      } do {
      ^bb0(%i: index):
        %next = arith.addi %i, %c1 : index
        scf.yield %next : index
      } attributes {piko.vector_lanes = 16}
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @HandsOn rank 1 {
  piko.buffer @out : @F
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %zero = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      // expected-error@+1 {{a loop is planned to be vectors, but it hands values from iteration to iteration}}
      %sum = scf.for %x = %c1 to %n step %c1 iter_args(%s = %zero) -> (f32) {
        %z = piko.load checked @out[%x : index] "z" : f32
        %more = arith.addf %s, %z : f32
        scf.yield %more : f32
      } {piko.lanes, piko.vector_lanes = 16}
      piko.store %sum, checked @out[%c1 : index] "z" : f32
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
