// RUN: piko-opt %s --split-input-file --verify-diagnostics

func.func @sizes(%count: memref<1xi32>, %lengths: memref<32xi32>, %starts: memref<32xi32>,
                 %classes: memref<?xi32>, %order: memref<96xi16>) {
  // expected-error@+1 {{expected arrays of constant size}}
  piko.gpu.drain %count, %lengths, %starts, %classes, %order
      : memref<1xi32>, memref<32xi32>, memref<32xi32>, memref<?xi32>, memref<96xi16> {
  ^bb0(%entry: index):
  }
  return
}

// -----

func.func @classes(%count: memref<1xi32>, %lengths: memref<32xi32>, %starts: memref<32xi32>,
                   %classes: memref<64xi32>, %order: memref<96xi16>) {
  // expected-error@+1 {{expected as many classes as places in the order, but got 'memref<64xi32>' and 'memref<96xi16>'}}
  piko.gpu.drain %count, %lengths, %starts, %classes, %order
      : memref<1xi32>, memref<32xi32>, memref<32xi32>, memref<64xi32>, memref<96xi16> {
  ^bb0(%entry: index):
  }
  return
}

// -----

func.func @lengths(%count: memref<1xi32>, %lengths: memref<32xi32>, %starts: memref<16xi32>,
                   %classes: memref<96xi32>, %order: memref<96xi16>) {
  // expected-error@+1 {{expected as many lengths as starts, but got 'memref<32xi32>' and 'memref<16xi32>'}}
  piko.gpu.drain %count, %lengths, %starts, %classes, %order
      : memref<1xi32>, memref<32xi32>, memref<16xi32>, memref<96xi32>, memref<96xi16> {
  ^bb0(%entry: index):
  }
  return
}

// -----

func.func @entry(%count: memref<1xi32>, %lengths: memref<32xi32>, %starts: memref<32xi32>,
                 %classes: memref<96xi32>, %order: memref<96xi16>) {
  // expected-error@+1 {{expected the number of an entry, an index, as the body's argument}}
  piko.gpu.drain %count, %lengths, %starts, %classes, %order
      : memref<1xi32>, memref<32xi32>, memref<32xi32>, memref<96xi32>, memref<96xi16> {
  ^bb0(%entry: i32):
  }
  return
}
