// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-lockstep))' --verify-diagnostics %s

// What cannot be one vector is cut at its barriers, which has its own limits.
piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @OtherControlFlow rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        // expected-note @below {{the operation is here}}
        scf.execute_region {
          // expected-error @below {{expected a barrier inside scf.if, scf.for, scf.while or scf.index_switch only, but got 'scf.execute_region'}}
          piko.sync
          scf.yield
        }
        piko.yield
      }
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
