// RUN: piko-opt %s --split-input-file --verify-diagnostics

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
    // expected-error @below {{expected each edge to be used once, but one of its edges has 0 uses}}
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
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
    // expected-error @below {{expected a stage, but got @c, which is none}}
    %1 = piko.join @c(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}

// -----

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
    // expected-error @below {{expected record @F, but got @G}}
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@G>
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
    // expected-error @below {{expected edge 0 to lead to @b, and each edge that leads there once}}
    %1 = piko.join @b(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%1) : (!piko.bins<@F>) -> ()
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
    // expected-error @below {{expected several edges to merge}}
    %1 = piko.join @a merge(concatenate %0 keys 1) : (!piko.edge<@F>) -> !piko.bins<@F>
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected a kernel, but got @kc, which is none}}
    %2 = piko.launch @kc(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected 1 results, one for each port, but got 2}}
    %2:2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> (!piko.edge<@F>, !piko.edge<@F>)
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected the kernel to take bins}}
    %2 = piko.launch @ka(%0) : (!piko.edge<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected the kernel to take bins}}
    %2 = piko.launch @ka() : () -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    // expected-error @below {{expected the bins of @b}}
    piko.launch @kb(%1) : (!piko.bins<@F>) -> ()
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
    // expected-error @below {{expected each edge to be used once, but one of its edges has 2 uses}}
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.feed 1 : !piko.edge<@F>
    // expected-error @below {{expected keys to merge by}}
    %2 = piko.join @a merge(concatenate %0 keys 1, concatenate %1) : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @ka(%2) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.feed 1 : !piko.edge<@F>
    // expected-error @below {{expected all that leads to @a, but 1 of its edges are not joined}}
    %2 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @ka(%2) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.feed 1 : !piko.edge<@F>
    // expected-error @below {{expected edge 1 to lead to @a, and each edge that leads there once}}
    %2 = piko.join @a merge(concatenate %0 keys 1, concatenate %0 keys 1) : (!piko.edge<@F>, !piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @ka(%2) : (!piko.bins<@F>) -> ()
  }
}
