// RUN: piko-opt %s --split-input-file --verify-diagnostics

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Empty rank 2 {
  piko.source @a
  // expected-error@+1 {{attribute 'label' failed to satisfy constraint: string attribute of letters, digits, spaces and _-.()}}
  piko.stage @a label "" bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Quote rank 2 {
  piko.source @a
  // expected-error@+1 {{attribute 'label' failed to satisfy constraint: string attribute of letters, digits, spaces and _-.()}}
  piko.stage @a label "a=b" bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Same rank 2 {
  piko.source @a
  piko.source @b
  // expected-error@+1 {{expected a label that no other stage has, but got 'A'}}
  piko.stage @a label "A" bins [0, 0] threads 1 : @F -> [] {}
  piko.stage @b label "A" bins [0, 0] threads 1 : @F -> [] {}
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Symbol rank 2 {
  piko.source @a
  piko.source @b
  piko.stage @a bins [0, 0] threads 1 : @F -> [] {}
  // expected-error@+1 {{expected a label that no other stage has, but got 'a'}}
  piko.stage @b label "a" bins [0, 0] threads 1 : @F -> [] {}
}
