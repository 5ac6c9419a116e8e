// RUN: piko-opt --split-input-file --verify-diagnostics %s

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<8xi1>
    %at = arith.constant dense<3> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.gather' op expected a mask of 16 lanes, but got 'vector<8xi1>'}}
    %a = piko.cpu.gather @in[%at : vector<16xindex>] "z" mask %mask : vector<8xi1>, vector<16xf32>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<8xindex>
    // expected-error@+1 {{'piko.cpu.gather' op expected an index for each of 16 lanes, but got 'vector<8xindex>'}}
    %a = piko.cpu.gather @in[%at : vector<8xindex>] "z" mask %mask : vector<16xi1>, vector<16xf32>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<16xindex>
    %v = arith.constant dense<1.0> : vector<16xf32>
    // expected-error@+1 {{'piko.cpu.scatter' op expected the indices of the first of consecutive lanes, but got 'vector<16xindex>'}}
    piko.cpu.scatter %v, consecutive @in[%at : vector<16xindex>] "z" mask %mask : vector<16xi1>, vector<16xf32>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.kernel @k {
    %at = arith.constant dense<3> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.elements' op expected the indices of the first of consecutive lanes, but got 'vector<16xindex>'}}
    %as = piko.cpu.elements consecutive @in[%at : vector<16xindex>] : vector<16xindex>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @F
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.gather' op expected field 'z' to be of type 'f32', but got 'i32'}}
    %a = piko.cpu.gather @in[%at : vector<16xindex>] "z" mask %mask : vector<16xi1>, vector<16xi32>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [] {}
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<8xindex>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    // expected-error@+1 {{'piko.cpu.items' op expected a position for each of 16 lanes, but got 'vector<8xindex>'}}
    %as = piko.cpu.items %bins[%at : vector<8xindex>] mask %mask : !piko.bins<@F>, vector<16xi1>, vector<16xindex>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %as = arith.constant dense<3> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.get' op expected a number for each of 16 lanes, but got 'vector<8xf32>'}}
    %x = piko.cpu.get %as "z" of @F mask %mask : vector<16xindex>, vector<16xi1>, vector<8xf32>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %as = arith.constant dense<3> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.get' op expected field 'z' to be of type 'f32', but got 'i32'}}
    %x = piko.cpu.get %as "z" of @F mask %mask : vector<16xindex>, vector<16xi1>, vector<16xi32>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %lanes = arith.constant dense<3> : vector<8xi32>
    // expected-error@+1 {{'piko.cpu.permute' op expected a lane for each of 16 lanes, but got 'vector<8xi32>'}}
    %r = piko.cpu.permute %v[%lanes] : vector<16xf32>, vector<8xi32>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<6xf32>
    %lanes = arith.constant dense<3> : vector<6xi32>
    // expected-error@+1 {{'piko.cpu.permute' op expected a power of two of lanes, but got 6}}
    %r = piko.cpu.permute %v[%lanes] : vector<6xf32>, vector<6xi32>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %mask = arith.constant dense<true> : vector<8xi1>
    // expected-error@+1 {{'piko.cpu.compress' op expected a number for each of 8 lanes, but got 'vector<16xf32>'}}
    %r = piko.cpu.compress %v mask %mask : vector<16xf32>, vector<8xi1>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %v = arith.constant 1.0 : f32
    %count = memref.alloca() : memref<1xi32>
    // expected-error@+1 {{'piko.storage.push' op expected an array for each of 1 numbers, but got 0}}
    piko.storage.push (%v : f32) count %count : memref<1xi32>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %v = arith.constant 1.0 : f32
    %list = memref.alloca() : memref<64xi32>
    %count = memref.alloca() : memref<1xi32>
    // expected-error@+1 {{'piko.storage.push' op expected an array of 'f32', but got 'memref<64xi32>'}}
    piko.storage.push (%v : f32) to (%list : memref<64xi32>) count %count : memref<1xi32>
  }
}

// -----

piko.pipeline @P rank 1 {
  piko.kernel @k {
    %most = arith.constant 64 : i64
    %count = memref.alloca() : memref<1xi32>
    // expected-error@+1 {{'piko.storage.push' op expected a limit of 'i32', but got 'i64'}}
    piko.storage.push count %count below %most : memref<1xi32>, i64
  }
}

// -----

piko.record @V {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %at = arith.constant dense<3> : vector<16xindex>
    %mask = arith.constant dense<true> : vector<16xi1>
    %few = arith.constant dense<true> : vector<8xi1>
    // expected-error@+1 {{'piko.cpu.set_fields' op expected a number for each of 2 fields, but got 1}}
    piko.cpu.set_fields(%v) to %at ["x", "y"] of @out mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
  }
}

// -----

piko.record @V {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %at = arith.constant dense<3> : vector<16xindex>
    %mask = arith.constant dense<true> : vector<16xi1>
    %few = arith.constant dense<true> : vector<8xi1>
    // expected-error@+1 {{'piko.cpu.set_fields' op expected field 'y' to be of type 'i32', but got 'f32'}}
    piko.cpu.set_fields(%v) to %at ["y"] of @out mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
  }
}

// -----

piko.record @V {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %at = arith.constant dense<3> : vector<16xindex>
    %mask = arith.constant dense<true> : vector<16xi1>
    %few = arith.constant dense<true> : vector<8xi1>
    // expected-error@+1 {{'piko.cpu.set_fields' op expected an address for each of 8 lanes, but got 'vector<16xindex>'}}
    piko.cpu.set_fields(%v) to %at ["x"] of @out mask %few : vector<16xindex>, vector<8xi1>, vector<16xf32>
  }
}

// -----

piko.record @V {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @out : @V
  piko.stage @a bins [0] threads 1 : @V -> [] {}
  piko.kernel @k {
    %v = arith.constant dense<1.0> : vector<16xf32>
    %at = arith.constant dense<3> : vector<16xindex>
    %mask = arith.constant dense<true> : vector<16xi1>
    %few = arith.constant dense<true> : vector<8xi1>
    // expected-error@+1 {{'piko.cpu.set_fields' op expected a piece of state, but got @a}}
    piko.cpu.set_fields(%v) to %at ["x"] of @a mask %mask : vector<16xindex>, vector<16xi1>, vector<16xf32>
  }
}

// -----

piko.record @N {"n" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @N
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<16xi32>
    // expected-error@+1 {{'piko.cpu.gather_run' op expected 1, 2, 4 or 8 bytes together, but got 3 elements of 4}}
    %a:3 = piko.cpu.gather_run @in[%at] "n" mask %mask : vector<16xi32>, vector<16xi1> -> vector<16xf32>, vector<16xf32>, vector<16xf32>
  }
}

// -----

piko.record @N {"n" : f32 at 0} size 4 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @N
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<8xi1>
    %at = arith.constant dense<3> : vector<16xi32>
    // expected-error@+1 {{'piko.cpu.gather_run' op expected an index and a mask of 16 lanes, but got 'vector<16xi32>' and 'vector<8xi1>'}}
    %a = piko.cpu.gather_run @in[%at] "n" mask %mask : vector<16xi32>, vector<8xi1> -> vector<16xf32>
  }
}

// -----

piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.buffer @in : @G
  piko.kernel @k {
    %mask = arith.constant dense<true> : vector<16xi1>
    %at = arith.constant dense<3> : vector<16xi32>
    // expected-error@+1 {{'piko.cpu.gather_run' op expected elements of no more than the field, but got records of 8 bytes}}
    %a = piko.cpu.gather_run @in[%at] "x" mask %mask : vector<16xi32>, vector<16xi1> -> vector<16xf32>
  }
}
