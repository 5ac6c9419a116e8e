// RUN: piko-opt %s --split-input-file --verify-diagnostics | FileCheck %s

// CHECK-LABEL: func.func @turn
// CHECK:         %[[SIDE:.*]], %[[TAKES:.*]] = piko.cpu.elect %{{.*}} second 3
func.func @turn(%c: i1) -> (i1, i1) {
  %side, %takes = piko.cpu.elect %c second 3
  return %side, %takes : i1, i1
}

// -----

func.func @none(%c: i1) -> i1 {
  // expected-error@+1 {{expected from 1 to 7 eighths of the lanes, but got 0}}
  %side, %takes = piko.cpu.elect %c second 0
  return %side : i1
}

// -----

func.func @more(%c: i1) -> i1 {
  // expected-error@+1 {{expected from 1 to 7 eighths of the lanes, but got 8}}
  %side, %takes = piko.cpu.elect %c second 8
  return %side : i1
}
