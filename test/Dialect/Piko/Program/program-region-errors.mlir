// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.record @G {"x" : i32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    // expected-error @below {{expected an argument for each edge that comes in, of its type}}
    piko.strips(%0) {
    ^bb0(%s: !piko.edge<@G>):
    } : (!piko.edge<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    // expected-error @below {{expected a result for each edge that leaves, of its type}}
    piko.strips(%0) {
    ^bb0(%s: !piko.edge<@F>):
    piko.leave %s : !piko.edge<@F>
    } : (!piko.edge<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    piko.strips(%0) {
    ^bb0(%s: !piko.edge<@F>):
    // expected-error @below {{expected nothing to go around}}
    piko.leave again %s : !piko.edge<@F>
    } : (!piko.edge<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    // expected-error @below {{expected what a piko.feed gives}}
    %s = piko.strips(%2) {
    ^bb0(%p: !piko.edge<@F>):
    piko.leave %p : !piko.edge<@F>
    } : (!piko.edge<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %s) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    // expected-error @below {{expected a turn in rounds alone}}
    %2 = piko.launch @ka(%1) turn 0 : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}
