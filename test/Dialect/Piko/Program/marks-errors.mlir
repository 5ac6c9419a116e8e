// RUN: piko-opt %s --split-input-file --verify-diagnostics

// Attributes by which passes tell later ones something are known by name and kind.

func.func @unknown(%a: i1, %b: i1) {
  // expected-error@+1 {{expected no attribute 'piko.lane', which the dialect does not know}}
  %c = arith.andi %a, %b {piko.lane} : i1
  return
}

// -----

func.func @unit(%a: i1, %b: i1) {
  // expected-error@+1 {{expected 'piko.short_circuit' to be a unit, but got "yes"}}
  %c = arith.andi %a, %b {piko.short_circuit = "yes"} : i1
  return
}

// -----

func.func @mapping(%n: index) {
  // expected-error@+1 {{expected 'piko.mapping' to be what lanes are given, as #piko<lanes items>, but got "items"}}
  scf.for %i = %n to %n step %n {
  } {piko.mapping = "items"}
  return
}

// -----

func.func @units(%n: index) {
  // expected-error@+1 {{expected 'piko.units' to be how threads share units, as #piko<units shared>, but got #piko<lanes items>}}
  scf.forall (%u) in (%n) {
  } {piko.units = #piko<lanes items>}
  return
}

// -----

func.func @number() {
  // expected-error@+1 {{expected 'piko.number' to be a 64-bit integer, but got 1 : i32}}
  func.call @number() {piko.number = 1 : i32} : () -> ()
  return
}

// -----

// expected-error@+1 {{expected 'piko.cpp_name' to be a string, but got 1 : i64}}
func.func @name() attributes {piko.cpp_name = 1} {
  return
}

// -----

func.func @pixels() {
  // expected-error@+1 {{expected 'piko.pixels' to be a string, but got unit}}
  %array = memref.alloca() {piko.pixels} : memref<4xf32>
  return
}

// -----

func.func @turns(%end: index) {
  %c1 = arith.constant 1 : index
  // expected-error@+1 {{expected 'piko.iterations' to be a 64-bit float, but got 8 : i64}}
  scf.for %i = %c1 to %end step %c1 {
  } {piko.iterations = 8}
  return
}

// -----

func.func @probabilities(%at: index) {
  // expected-error@+1 {{expected 'piko.probabilities' to be an array of 64-bit floats, but got array<f32: 1.000000e+00, 0.000000e+00>}}
  scf.index_switch %at {piko.probabilities = array<f32: 1.0, 0.0>}
  case 1 {
    scf.yield
  }
  default {
  }
  return
}

// -----

// expected-error@+1 {{expected 'piko.steps' to be an array of steps, such as #piko.step<clear 0>, but got [0]}}
func.func @steps() attributes {piko.steps = [0]} {
  return
}
