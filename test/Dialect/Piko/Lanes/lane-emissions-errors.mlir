// RUN: piko-opt --split-input-file --verify-diagnostics %s
// What vectors emit is what the port takes, with as many lanes as the mask has.

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{'piko.cpu.append' op expected the numbers of 1 of record @G, ('vector<16xf32>', 'vector<16xi32>'), but got ('vector<16xf32>')}}
    piko.cpu.append %writer[0] (%x : vector<16xf32>) of @G mask %mask : vector<16xi1>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{'piko.cpu.append' op expected primitives of record @G, which port 0 emits, but got @F}}
    piko.cpu.append %writer[0] (%x : vector<16xf32>) of @F mask %mask : vector<16xi1>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    // expected-error@+1 {{'piko.cpu.append' op expected a port below 1, which is how many the kernel of stage 'a' has, but got 1}}
    piko.cpu.append %writer[1] (%x, %y : vector<16xf32>, vector<16xi32>) of @G mask %mask : vector<16xi1>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %at = arith.constant dense<1> : vector<8xindex>
    // expected-error@+1 {{'piko.cpu.append' op expected an element for each of 16 lanes, but got 'vector<8xindex>'}}
    piko.cpu.append %writer[0] (%x, %y : vector<16xf32>, vector<16xi32>) of @G mask %mask : vector<16xi1> in @b[%at : vector<8xindex>]
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %at = arith.constant dense<1> : vector<16xindex>
    // expected-error@+1 {{'piko.cpu.append' op expected a bin for each of 1 records, but got 2}}
    piko.cpu.append %writer[0] (%x, %y : vector<16xf32>, vector<16xi32>) of @G mask %mask : vector<16xi1> in @b[%at, %at : vector<16xindex>, vector<16xindex>]
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %memory = memref.alloca() : memref<256xi8>
    // expected-error@+1 {{'piko.cpu.store_records' op expected the numbers of 1 of record @G, ('vector<16xf32>', 'vector<16xi32>'), but got ('vector<16xi32>', 'vector<16xf32>')}}
    piko.cpu.store_records %memory (%y, %x : vector<16xi32>, vector<16xf32>) of @G : memref<256xi8>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}

// -----

piko.record @F {"z" : f32 at 0} size 4 align 4
piko.record @G {"x" : f32 at 0, "y" : i32 at 4} size 8 align 4
piko.pipeline @P rank 1 {
  piko.source @a
  piko.stage @a bins [0] threads 1 : @F -> [@G] {}
  piko.stage @b bins [8] threads 1 : @G -> [] {}
  piko.edge @a[0] -> @b
  piko.kernel @k {
    %c0 = arith.constant 0 : index
    %mask = arith.constant dense<true> : vector<16xi1>
    %x = arith.constant dense<1.0> : vector<16xf32>
    %y = arith.constant dense<1> : vector<16xi32>
    %bins = piko.storage.open_bins @a : !piko.bins<@F>
    %writer = piko.cpu.open_writer %bins[%c0] : !piko.bins<@F>
    %memory = memref.alloca() : memref<256xi8>
    // expected-error@+1 {{'piko.cpu.append_record' op expected a primitive of record @G, which port 0 emits, but got @F}}
    %p = piko.cpu.append_record %writer[0] from %memory[%c0 of 16] : memref<256xi8> -> !piko.prim<@F>
    piko.storage.close_bins %bins : !piko.bins<@F>
  }
}
