// RUN: piko-opt --split-input-file --verify-diagnostics %s

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Unknown rank 1 {
  piko.program ranks {
    // expected-error @below {{expected a stage, but got @none}}
    piko.partition @none bins
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Parts rank 1 {
  piko.source @s
  piko.stage @s bins [8] threads 1 : @F -> [] {}
  piko.program ranks {
    // expected-error @below {{expected a stage of one bin that takes no list, but got @s}}
    piko.partition @s parts
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Keep rank 1 {
  piko.constant @c : @F
  piko.program ranks {
    // expected-error @below {{expected an image or a buffer, but got @c, which is none}}
    piko.keep @c
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Owner rank 1 {
  piko.buffer @b : @F
  piko.source @s
  piko.stage @s bins [8] threads 1 : @F -> [] {}
  piko.program ranks {
    // expected-error @below {{expected an image, whose pixels bins own, but got @b}}
    piko.share @b of @s
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Ways rank 1 {
  piko.buffer @b : @F
  piko.program ranks {
    // expected-error @below {{expected one way to bring ranks' changes together}}
    piko.share @b from_first reduce ["x", "add"]
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Odd rank 1 {
  piko.buffer @b : @F
  piko.program ranks {
    // expected-error @below {{expected a field and an operation for each reduction}}
    piko.share @b reduce ["x"]
  }
}

// -----

piko.record @F {"x" : f32 at 0} size 4 align 4
piko.pipeline @Floats rank 1 {
  piko.buffer @b : @F
  piko.program ranks {
    // expected-error @below {{expected an operation on integers, but got "add_float"}}
    piko.share @b reduce ["x", "add_float"]
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @First rank 1 {
  piko.source @s
  piko.stage @s bins [8] threads 1 : @F -> [] {}
  piko.program ranks {
    // expected-error @below {{expected more than one rank to run a stage}}
    piko.partition @s first
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoBins rank 1 {
  piko.source @s
  piko.stage @s bins [0] threads 1 : @F -> [] {}
  piko.program ranks {
    // expected-error @below {{expected owners of bins alone}}
    piko.partition @s all owners load
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Cleared rank 1 {
  piko.buffer @b : @F
  piko.program ranks {
    // expected-error @below {{expected state that a run clears, but got @b}}
    piko.keep @b cleared
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @Common rank 1 {
  piko.buffer @b : @F
  piko.source @s
  piko.stage @s bins [8] threads 1 : @F -> [] {}
  piko.program ranks {
    // expected-error @below {{expected an image, but got @b}}
    piko.common @b of @s
  }
}

// -----

piko.record @F {"x" : i32 at 0} size 4 align 4
piko.pipeline @NoOwners rank 1 {
  piko.image @i : @F rank 1
  piko.program ranks {
    // expected-error @below {{expected the stage whose bins' owners it goes to}}
    piko.share @i to_owners
  }
}
