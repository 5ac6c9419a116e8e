// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-distribute-loops{lanes=0}))' %s 2>&1 | FileCheck %s
// RUN: not piko-opt --pass-pipeline='builtin.module(piko.pipeline(piko-reduce-strength{lanes=3}))' %s 2>&1 | FileCheck %s

// CHECK: lanes-errors.mlir:[[#@LINE+1]]:1: error: expected 4, 8 or 16 lanes, but got {{0|3}}
piko.pipeline @P rank 1 {
}
