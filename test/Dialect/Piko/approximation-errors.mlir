// RUN: piko-opt --split-input-file --verify-diagnostics %s

func.func @wide(%x: f64) -> f64 {
  // expected-error @below {{expected f32 or a vector of it, but got 'f64'}}
  %r = piko.approximate_reciprocal %x : f64
  return %r : f64
}

// -----

func.func @narrow(%x: vector<4xf16>) -> vector<4xf16> {
  // expected-error @below {{expected f32 or a vector of it, but got 'vector<4xf16>'}}
  %r = piko.approximate_rsqrt %x : vector<4xf16>
  return %r : vector<4xf16>
}

// -----

func.func @whole(%x: f64) -> f64 {
  // expected-error @below {{expected f32 or a vector of it, but got 'f64'}}
  %r = piko.approximate_sqrt %x : f64
  return %r : f64
}
