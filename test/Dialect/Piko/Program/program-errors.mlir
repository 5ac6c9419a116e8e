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
    // expected-error @below {{expected a source, but got 1, which is none}}
    %0 = piko.feed 1 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected record @F, but got @G}}
    %0 = piko.feed 0 : !piko.edge<@G>
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @host : @F
  piko.source @a
  piko.edge @a[0] -> @b
  piko.stage @a bins [0] threads 1 : @F -> [@F] {}
  piko.stage @b bins [0] threads 1 : @F -> [] {}
  piko.kernel @ka { %bins = piko.storage.open_bins @a : !piko.bins<@F> }
  piko.kernel @kb { %bins = piko.storage.open_bins @b : !piko.bins<@F> }
  piko.program {
    // expected-error @below {{expected an image, or a buffer that is sized by a source, but got @host, which is none}}
    piko.clear @host
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected the kernel of @b to be launched before}}
    piko.wait @b
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected a stage, but got @c, which is none}}
    piko.wait @c
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
    // expected-error @below {{expected a stage whose schedule has a body, but got @a}}
    piko.schedule_bins @a
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
  // expected-error @below {{expected a launch of @ka}}
  piko.program {
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
    // expected-error @below {{expected only statements of a program}}
    %c = arith.constant 0 : i32
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
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
  // expected-error @below {{expected a stage that collects, but got @a}}
  piko.program roots [@a] {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
// expected-error @below {{expected one program}}
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
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
  piko.program {
    %0 = piko.feed 0 : !piko.edge<@F>
    %1 = piko.join @a(concatenate %0) : (!piko.edge<@F>) -> !piko.bins<@F>
    %2 = piko.launch @ka(%1) : (!piko.bins<@F>) -> !piko.edge<@F>
    %3 = piko.join @b(concatenate %2) : (!piko.edge<@F>) -> !piko.bins<@F>
    piko.launch @kb(%3) : (!piko.bins<@F>) -> ()
  }
}
