// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-plan-vectors,piko-vectorize))' --split-input-file --verify-diagnostics %s

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// Each iteration of the outer loop reads the same numbers again, which are in the
// cache: lanes share their lines' cost over all iterations.
piko.pipeline @ReadsAgain rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %all = scf.for %y = %c0 to %c32 step %c1 iter_args(%a = %none) -> f32 {
          %sum = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %a) -> f32 {
            %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
            %0 = arith.mulf %z, %s : f32
            %1 = arith.addf %0, %z : f32
            %2 = arith.mulf %1, %1 : f32
            %3 = arith.addf %2, %z : f32
            scf.yield %3 : f32
          }
          scf.yield %sum : f32
        }
        piko.store %all, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// The same sums of what is read once: as many lines as there are lanes.
piko.pipeline @ReadsOnce rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is not vectorized: 16 at once are expected to take}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %sum = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %none) -> f32 {
          // expected-note@+1 {{lanes access elements in different places}}
          %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
          %0 = arith.mulf %z, %s : f32
          %1 = arith.addf %0, %z : f32
          %2 = arith.mulf %1, %1 : f32
          %3 = arith.addf %2, %z : f32
          scf.yield %3 : f32
        }
        piko.store %sum, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Item {"k" : i32 at 0} size 4 align 4
piko.record @Node {"next" : i32 at 0, "x" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// A list: each node says where the next one is, and one iteration waits for each
// of them. Lanes wait together, for which a gather is little.
piko.pipeline @Chases rank 1 {
  piko.buffer @nodes : @Node
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Item -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : i32
    %c1 = arith.constant 1 : index
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Item>
    %n = piko.storage.unit_count %bins : !piko.bins<@Item>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Item>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Item> -> !piko.prim<@Item>
        %k = piko.get %f "k" : !piko.prim<@Item> -> i32
        %all:2 = scf.while (%at = %k, %sum = %none) : (i32, f32) -> (i32, f32) {
          %more = arith.cmpi sge, %at, %c0 : i32
          scf.condition(%more) %at, %sum : i32, f32
        } do {
        ^bb0(%at: i32, %sum: f32):
          // expected-note@+1 {{lanes read 'nodes' in different places, by a gather}}
          %next = piko.load checked @nodes[%at : i32] "next" : i32
          // expected-note@+1 {{lanes read 'nodes' in different places, by a gather}}
          %x = piko.load checked @nodes[%at : i32] "x" : f32
          %more = arith.addf %sum, %x : f32
          scf.yield %next, %more : i32, f32
        }
        piko.store %all#1, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Item>
  }
}

// -----

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// What a loop on one side of a condition does in place of nothing may be a slow path,
// where all go on after it: it is weighed as one that may run or not.
piko.pipeline @SlowPath rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %zero = arith.constant 0 : i32
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is vectorized for 32 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %first = piko.get %f "z"[%c0] : !piko.prim<@Row> -> f32
        %fast = arith.cmpi sge, %k, %zero : i32
        %sum = scf.if %fast -> f32 {
          scf.yield %first : f32
        } else {
          %slow = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %none) -> f32 {
            %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
            %0 = arith.mulf %z, %s : f32
            %1 = arith.addf %0, %z : f32
            %2 = arith.mulf %1, %1 : f32
            %3 = arith.addf %2, %z : f32
            scf.yield %3 : f32
          }
          scf.yield %slow : f32
        }
        %w0 = arith.addf %sum, %first : f32
        %w1 = arith.mulf %w0, %w0 : f32
        %w2 = arith.addf %w1, %w1 : f32
        %w3 = arith.mulf %w2, %w2 : f32
        %w4 = arith.addf %w3, %w3 : f32
        %w5 = arith.mulf %w4, %w4 : f32
        %w6 = arith.addf %w5, %w5 : f32
        %w7 = arith.mulf %w6, %w6 : f32
        %w8 = arith.addf %w7, %w7 : f32
        %w9 = arith.mulf %w8, %w8 : f32
        %w10 = arith.addf %w9, %w9 : f32
        %w11 = arith.mulf %w10, %w10 : f32
        %w12 = arith.addf %w11, %w11 : f32
        %w13 = arith.mulf %w12, %w12 : f32
        %w14 = arith.addf %w13, %w13 : f32
        %w15 = arith.mulf %w14, %w14 : f32
        %w16 = arith.addf %w15, %w15 : f32
        %w17 = arith.mulf %w16, %w16 : f32
        %w18 = arith.addf %w17, %w17 : f32
        %w19 = arith.mulf %w18, %w18 : f32
        %w20 = arith.addf %w19, %w19 : f32
        %w21 = arith.mulf %w20, %w20 : f32
        %w22 = arith.addf %w21, %w21 : f32
        %w23 = arith.mulf %w22, %w22 : f32
        %w24 = arith.addf %w23, %w23 : f32
        %w25 = arith.mulf %w24, %w24 : f32
        %w26 = arith.addf %w25, %w25 : f32
        %w27 = arith.mulf %w26, %w26 : f32
        %w28 = arith.addf %w27, %w27 : f32
        %w29 = arith.mulf %w28, %w28 : f32
        %w30 = arith.addf %w29, %w29 : f32
        %w31 = arith.mulf %w30, %w30 : f32
        %w32 = arith.addf %w31, %w31 : f32
        %w33 = arith.mulf %w32, %w32 : f32
        %w34 = arith.addf %w33, %w33 : f32
        %w35 = arith.mulf %w34, %w34 : f32
        %w36 = arith.addf %w35, %w35 : f32
        %w37 = arith.mulf %w36, %w36 : f32
        %w38 = arith.addf %w37, %w37 : f32
        %w39 = arith.mulf %w38, %w38 : f32
        piko.store %w39, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Row {"z" : f32[32 : 4] at 0, "k" : i32 at 128} size 132 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// The same loop, which is the last that is done, is what there is to do.
piko.pipeline @MainPath rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %c1 = arith.constant 1 : index
    %c32 = arith.constant 32 : index
    %zero = arith.constant 0 : i32
    %none = arith.constant 0.0 : f32
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is not vectorized: 16 at once are expected to take}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %first = piko.get %f "z"[%c0] : !piko.prim<@Row> -> f32
        %fast = arith.cmpi sge, %k, %zero : i32
        %sum = scf.if %fast -> f32 {
          scf.yield %first : f32
        } else {
          %slow = scf.for %x = %c0 to %c32 step %c1 iter_args(%s = %none) -> f32 {
            // expected-note@+1 {{lanes access elements in different places}}
            %z = piko.get %f "z"[%x] : !piko.prim<@Row> -> f32
            %0 = arith.mulf %z, %s : f32
            %1 = arith.addf %0, %z : f32
            %2 = arith.mulf %1, %1 : f32
            %3 = arith.addf %2, %z : f32
            scf.yield %3 : f32
          }
          scf.yield %slow : f32
        }
        piko.store %sum, checked @out[%k : i32] "z" : f32
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Row {"x" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// Guards, each all that the one around it does: where each mostly lets through, all
// mostly do, however many they are.
piko.pipeline @Guards rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is vectorized for 16 primitives at once}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %x0 = piko.get %f "x" : !piko.prim<@Row> -> f32
        %x1 = arith.mulf %x0, %x0 : f32
        %g0 = arith.cmpf olt, %x1, %x0 : f32
        scf.if %g0 {
          %x2 = arith.mulf %x1, %x1 : f32
          %g1 = arith.cmpf olt, %x2, %x1 : f32
          scf.if %g1 {
            %x3 = arith.mulf %x2, %x2 : f32
            %g2 = arith.cmpf olt, %x3, %x2 : f32
            scf.if %g2 {
              %x4 = arith.mulf %x3, %x3 : f32
              %g3 = arith.cmpf olt, %x4, %x3 : f32
              scf.if %g3 {
                %x5 = arith.mulf %x4, %x4 : f32
                %g4 = arith.cmpf olt, %x5, %x4 : f32
                scf.if %g4 {
                  %x6 = arith.mulf %x5, %x5 : f32
                  %g5 = arith.cmpf olt, %x6, %x5 : f32
                  scf.if %g5 {
                    %x7 = arith.mulf %x6, %x6 : f32
                    %g6 = arith.cmpf olt, %x7, %x6 : f32
                    scf.if %g6 {
                      %x8 = arith.mulf %x7, %x7 : f32
                      %g7 = arith.cmpf olt, %x8, %x7 : f32
                      scf.if %g7 {
                        %x9 = arith.mulf %x8, %x8 : f32
                        %g8 = arith.cmpf olt, %x9, %x8 : f32
                        scf.if %g8 {
                          %x10 = arith.mulf %x9, %x9 : f32
                          %g9 = arith.cmpf olt, %x10, %x9 : f32
                          scf.if %g9 {
                            %x11 = arith.mulf %x10, %x10 : f32
                            %g10 = arith.cmpf olt, %x11, %x10 : f32
                            scf.if %g10 {
                              %x12 = arith.mulf %x11, %x11 : f32
                              %g11 = arith.cmpf olt, %x12, %x11 : f32
                              scf.if %g11 {
                                %w0 = math.sqrt %x12 : f32
                                %w1 = math.sqrt %w0 : f32
                                %w2 = math.sqrt %w1 : f32
                                %w3 = math.sqrt %w2 : f32
                                %w4 = math.sqrt %w3 : f32
                                %w5 = math.sqrt %w4 : f32
                                %w6 = math.sqrt %w5 : f32
                                %w7 = math.sqrt %w6 : f32
                                %w8 = math.sqrt %w7 : f32
                                %w9 = math.sqrt %w8 : f32
                                %w10 = math.sqrt %w9 : f32
                                %w11 = math.sqrt %w10 : f32
                                %w12 = math.sqrt %w11 : f32
                                %w13 = math.sqrt %w12 : f32
                                %w14 = math.sqrt %w13 : f32
                                %w15 = math.sqrt %w14 : f32
                                %w16 = math.sqrt %w15 : f32
                                %w17 = math.sqrt %w16 : f32
                                %w18 = math.sqrt %w17 : f32
                                %w19 = math.sqrt %w18 : f32
                                %w20 = math.sqrt %w19 : f32
                                %w21 = math.sqrt %w20 : f32
                                %w22 = math.sqrt %w21 : f32
                                %w23 = math.sqrt %w22 : f32
                                piko.store %w23, checked @out[%k : i32] "z" : f32
                              }
                            }
                          }
                        }
                      }
                    }
                  }
                }
              }
            }
          }
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}

// -----

piko.record @Row {"x" : f32 at 0, "k" : i32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4

// Where something follows each one, the work in the innermost is as rare as the
// product of all says.
piko.pipeline @GuardsWithWorkBehind rank 1 {
  piko.buffer @out : @D
  piko.source @a
  piko.stage @a bins [0] threads 1 : @Row -> [] {}
  piko.kernel @k {
    %c1 = arith.constant 1 : index
    %bins = piko.storage.open_bins @a : !piko.bins<@Row>
    %n = piko.storage.unit_count %bins : !piko.bins<@Row>
    scf.forall (%u) in (%n) {
      %lo, %hi = piko.storage.bucket_range %bins[%u, %u] : !piko.bins<@Row>
      // expected-remark@+1 {{stage 'a': process is not vectorized: 16 at once are expected to take}}
      scf.for %i = %lo to %hi step %c1 {
        %f = piko.storage.item %bins[%i] : !piko.bins<@Row> -> !piko.prim<@Row>
        %k = piko.get %f "k" : !piko.prim<@Row> -> i32
        %x0 = piko.get %f "x" : !piko.prim<@Row> -> f32
        %x1 = arith.mulf %x0, %x0 : f32
        %g0 = arith.cmpf olt, %x1, %x0 : f32
        scf.if %g0 {
          %x2 = arith.mulf %x1, %x1 : f32
          %g1 = arith.cmpf olt, %x2, %x1 : f32
          scf.if %g1 {
            %x3 = arith.mulf %x2, %x2 : f32
            %g2 = arith.cmpf olt, %x3, %x2 : f32
            scf.if %g2 {
              %x4 = arith.mulf %x3, %x3 : f32
              %g3 = arith.cmpf olt, %x4, %x3 : f32
              scf.if %g3 {
                %x5 = arith.mulf %x4, %x4 : f32
                %g4 = arith.cmpf olt, %x5, %x4 : f32
                scf.if %g4 {
                  %x6 = arith.mulf %x5, %x5 : f32
                  %g5 = arith.cmpf olt, %x6, %x5 : f32
                  scf.if %g5 {
                    %x7 = arith.mulf %x6, %x6 : f32
                    %g6 = arith.cmpf olt, %x7, %x6 : f32
                    scf.if %g6 {
                      %x8 = arith.mulf %x7, %x7 : f32
                      %g7 = arith.cmpf olt, %x8, %x7 : f32
                      scf.if %g7 {
                        %x9 = arith.mulf %x8, %x8 : f32
                        %g8 = arith.cmpf olt, %x9, %x8 : f32
                        scf.if %g8 {
                          %x10 = arith.mulf %x9, %x9 : f32
                          %g9 = arith.cmpf olt, %x10, %x9 : f32
                          scf.if %g9 {
                            %x11 = arith.mulf %x10, %x10 : f32
                            %g10 = arith.cmpf olt, %x11, %x10 : f32
                            scf.if %g10 {
                              %x12 = arith.mulf %x11, %x11 : f32
                              %g11 = arith.cmpf olt, %x12, %x11 : f32
                              scf.if %g11 {
                                %w0 = math.sqrt %x12 : f32
                                %w1 = math.sqrt %w0 : f32
                                %w2 = math.sqrt %w1 : f32
                                %w3 = math.sqrt %w2 : f32
                                %w4 = math.sqrt %w3 : f32
                                %w5 = math.sqrt %w4 : f32
                                %w6 = math.sqrt %w5 : f32
                                %w7 = math.sqrt %w6 : f32
                                %w8 = math.sqrt %w7 : f32
                                %w9 = math.sqrt %w8 : f32
                                %w10 = math.sqrt %w9 : f32
                                %w11 = math.sqrt %w10 : f32
                                %w12 = math.sqrt %w11 : f32
                                %w13 = math.sqrt %w12 : f32
                                %w14 = math.sqrt %w13 : f32
                                %w15 = math.sqrt %w14 : f32
                                %w16 = math.sqrt %w15 : f32
                                %w17 = math.sqrt %w16 : f32
                                %w18 = math.sqrt %w17 : f32
                                %w19 = math.sqrt %w18 : f32
                                %w20 = math.sqrt %w19 : f32
                                %w21 = math.sqrt %w20 : f32
                                %w22 = math.sqrt %w21 : f32
                                %w23 = math.sqrt %w22 : f32
                                piko.store %w23, checked @out[%k : i32] "z" : f32
                              }
                              piko.store %x11, checked @out[%k : i32] "z" : f32
                            }
                            piko.store %x10, checked @out[%k : i32] "z" : f32
                          }
                          piko.store %x9, checked @out[%k : i32] "z" : f32
                        }
                        piko.store %x8, checked @out[%k : i32] "z" : f32
                      }
                      piko.store %x7, checked @out[%k : i32] "z" : f32
                    }
                    piko.store %x6, checked @out[%k : i32] "z" : f32
                  }
                  piko.store %x5, checked @out[%k : i32] "z" : f32
                }
                piko.store %x4, checked @out[%k : i32] "z" : f32
              }
              piko.store %x3, checked @out[%k : i32] "z" : f32
            }
            piko.store %x2, checked @out[%k : i32] "z" : f32
          }
          piko.store %x1, checked @out[%k : i32] "z" : f32
        }
      } {piko.lanes, piko.mapping = #piko<lanes items>}
    }
    piko.storage.close_bins %bins : !piko.bins<@Row>
  }
}
