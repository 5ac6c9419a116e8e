// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// PTX gives the reference executor's results and errors, behind the driver for
// tests: what the programs of other tests have of lists, cycles, strips,
// barriers, collectives, local edges and numbers.
// DEFINE: %{cuda} = --target cuda --runs 1 --threads 2
// RUN: export PIKO_CUDA_DRIVER=%test_driver
// RUN: piko-compare %S/gpu.cpp --pipe Boxes --count 600 --gpu-threads 64 %{cuda} | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=7 piko-compare %S/gpu.cpp --pipe Boxes --count 200 --gpu-threads 8 --strip 13 --domain 61 43 --wide %{cuda} | FileCheck %s
// RUN: piko-compare %S/gpu.cpp --pipe Whole --count 400 --gpu-threads 4 %{cuda} | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=8 piko-compare %S/update-order.cpp --pipe Shared --count 1500 --gpu-threads 64 %{cuda} | FileCheck %s
// RUN: piko-compare %S/algorithms.cpp --gpu-threads 32 %{cuda} | FileCheck %s
// RUN: piko-compare %S/lists.mlir --reference %S/Inputs/lists.cpp --count 300 --gpu-threads 32 %{cuda} | FileCheck %s
// RUN: piko-compare %S/cycles.mlir --reference %S/Inputs/cycles.cpp --count 100 --gpu-threads 64 %{cuda} | FileCheck %s
// RUN: piko-compare %S/strips.cpp --count 300 --strip 7 --gpu-threads 32 %{cuda} | FileCheck %s
// RUN: env PIKO_TEST_DRIVER_SEED=9 piko-compare %S/gpu-collectives.cpp --pipe Collected --count 700 --gpu-threads 128 %{cuda} | FileCheck %s
// RUN: piko-compare %S/barrier-control-flow.cpp --pipe Few --count 400 --gpu-threads 64 %{cuda} | FileCheck %s
// RUN: piko-compare %S/local-barrier.cpp --pipe Chain --domain 67 35 --count 500 --gpu-threads 64 %{cuda} | FileCheck %s
// RUN: sed -n 's|^// CASE: ||p' %S/overflow.cpp > %t.cases
// RUN: piko-compare %S/overflow.cpp --cases %t.cases --gpu-threads 32 %{cuda} | FileCheck %s
// CHECK: {{^equal$}}
//
// RUN: env PIKO_TEST_DRIVER_SEED=3 not piko-compare %S/gpu.cpp --pipe Stops --count 500 --runs 1 --target cuda --gpu-threads 32 | FileCheck %S/gpu.cpp --check-prefix=STOPS
