// RUN: piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-defer-shading))' --split-input-file --verify-diagnostics %s | FileCheck %s
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-defer-shading{budget=-1}))' --split-input-file %s 2>&1 | FileCheck %s --check-prefix=BUDGET
// BUDGET: error: expected a budget of at least 0 bytes, but got -1
//
// Shading that stays where it is.
// CHECK-NOT: memref.alloca

// A bin without an extent, which piko-form-gbuffer is for.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [0] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// Owners of pixels.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
  // expected-note @below {{threads share a bin by the pixels that primitives update; give the stage smaller bins}}
  piko.stage @last bins [64] threads 1 tile 8 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// A pixel that may be in another bin.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
    piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        // expected-note @below {{this pixel is not proved to be in the bin; take one of parallelForPixels}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        }
      }
    }
  }
}

// -----

// A bin of which too much is kept.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
  // expected-note @below {{what is kept of a bin may have 262144 bytes, but this has 320000; give the stage smaller bins}}
  piko.stage @last bins [40000] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// A bin whose pixels are too many to count.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
  // expected-note @below {{what is kept of a bin may have 262144 bytes, but this has 8796093022208; give the stage smaller bins}}
  piko.stage @last bins [4611686018427387904] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// Two updates that do not do the same.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
    piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        // expected-remark @below {{what is written to 'color' is computed also where it is overwritten}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
        %turns = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %n = arith.subf %before, %l : f32
          scf.yield %n : f32
        }
        // expected-note @below {{this does not do the same as the update before; let both end in one computation, as in a function that both call}}
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          %both = arith.addf %turns, %a : f32
          piko.yield [%both : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// All primitives count.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
    piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          %more = arith.addf %old, %sum : f32
          piko.yield [%more : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// What is read is not overwritten for the last time.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
    piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%sum : f32]
        } {piko.inside}
        %read = piko.load @color[%x : i32] "z" : f32
        piko.store %read, @reads[%x : i32] "z" : f32
      }
    }
  }
}

// -----

// Little is computed.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.buffer @reads : @D
  piko.image @color : @D rank 1
  piko.source @last
    piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32):
          piko.yield [%a : f32]
        } {piko.inside}
      }
    }
  }
}

// -----

// One sum for several pixels: each would compute it for itself.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @D {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @lights : @D
  piko.image @color : @D rank 1
  piko.source @last
  piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  piko.kernel @kernel_last {
    %zero = arith.constant 0 : index
    %one = arith.constant 1 : index
    %four = arith.constant 4 : index
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %count = piko.extent @lights[0]
        %sum = scf.for %i = %zero to %count step %one iter_args(%before = %a) -> f32 {
          %l = piko.load checked @lights[%i : index] "z" : f32
          %m = arith.mulf %l, %a : f32
          %n = arith.divf %m, %l : f32
          %after = arith.addf %before, %n : f32
          scf.yield %after : f32
        }
        scf.for %k = %zero to %four step %one {
          %step = arith.index_cast %k : index to i32
          %at = arith.addi %x, %step : i32
          piko.update @color[%at : i32] in %bin {
          ^bb0(%old: f32):
            piko.yield [%sum : f32]
          } {piko.inside}
        }
      }
    }
  }
}

// -----

// What takes long is of the test, which has to be done anyway: the color alone
// would be computed once, and is too little for that. The update is not even
// taken apart.

piko.record @F {"x" : i32 at 0, "a" : f32 at 4} size 8 align 4
piko.record @P {"z" : f32 at 0, "c" : f32 at 4} size 8 align 4
piko.pipeline @Cheap rank 1 {
  piko.image @color : @P rank 1
  piko.source @last
  piko.stage @last bins [64] threads 1 ordered : @F -> [] {}
  // CHECK-LABEL: piko.kernel @kernel_cheap
  piko.kernel @kernel_cheap {
    piko.bins of @last {
    ^bb0(%bin: index):
      piko.items of @last {
      ^bb0(%f: !piko.prim<@F>):
        %x = piko.get %f "x" : !piko.prim<@F> -> i32
        %a = piko.get %f "a" : !piko.prim<@F> -> f32
        %d = math.sqrt %a : f32
        %e = arith.divf %a, %d : f32
        %g = math.exp %e : f32
        %h = math.log %g : f32
        %i = math.sin %h : f32
        %z = math.cos %i : f32
        // CHECK: piko.update
        // CHECK-NOT: results[
        // CHECK-NOT: piko.update
        piko.update @color[%x : i32] in %bin {
        ^bb0(%old: f32, %oldColor: f32):
          %test = arith.cmpf olt, %z, %old : f32
          %depth = arith.select %test, %z, %old : f32
          %c = scf.if %test -> f32 {
            %less = arith.addf %z, %a : f32
            scf.yield %less : f32
          } else {
            scf.yield %oldColor : f32
          }
          piko.yield [%depth, %c : f32, f32]
        } {piko.inside}
      }
    }
  }
}
