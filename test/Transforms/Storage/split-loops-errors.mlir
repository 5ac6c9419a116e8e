// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-split-loops))' --allow-unregistered-dialect --split-input-file --verify-diagnostics %s

piko.pipeline @NoWriter rank 1 {
  piko.kernel @k {
    %n = arith.constant 8 : index
    // expected-error @below {{expected to be in the loop over a kernel's units}}
    piko.parallel_for %n {
    ^bb0(%i: index):
      piko.sync
      piko.yield
    }
  }
}

// -----

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

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @Vector rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        // expected-error @below {{expected a number, a primitive or a private array to live across a barrier, but got type 'complex<f32>'}}
        %v = "test.make"(%i) : (index) -> complex<f32>
        piko.sync
        "test.use"(%v) : (complex<f32>) -> ()
        piko.yield
      }
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @ResultOfBranch rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %n = piko.storage.unit_count %bins : !piko.bins<@F>
    %c = arith.constant true
    scf.forall (%u) in (%n) {
      %w = piko.cpu.open_writer %bins[%u] : !piko.bins<@F>
      piko.parallel_for %n {
      ^bb0(%i: index):
        %v = "test.make"(%i) : (index) -> complex<f32>
        // expected-error @below {{expected a number or a primitive to live across a barrier, but got type 'complex<f32>'}}
        %r = scf.if %c -> complex<f32> {
          piko.sync
          scf.yield %v : complex<f32>
        } else {
          scf.yield %v : complex<f32>
        }
        "test.use"(%r) : (complex<f32>) -> ()
        piko.yield
      }
      piko.cpu.close_writer %w
    }
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
