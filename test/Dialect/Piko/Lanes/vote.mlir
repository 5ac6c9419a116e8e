// RUN: piko-opt %s --split-input-file --verify-diagnostics | FileCheck %s

// CHECK-LABEL: func.func @ways
// CHECK:         %[[ALL:.*]] = piko.cpu.vote %{{.*}}
func.func @ways(%c: i1) -> i1 {
  %all = piko.cpu.vote %c
  return %all : i1
}

// -----

func.func @lanes(%c: vector<8xi1>) -> i1 {
  // expected-error@+1 {{operand #0 must be 1-bit signless integer}}
  %all = "piko.cpu.vote"(%c) : (vector<8xi1>) -> i1
  return %all : i1
}
