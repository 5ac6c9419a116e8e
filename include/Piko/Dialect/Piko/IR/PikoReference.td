// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// All of the dialect, for its reference document.

include "Piko/Dialect/Piko/IR/PikoOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoCheckOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoCountOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoFixedOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoCPUOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoProgramOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoGPUOps.td"
include "Piko/Dialect/Piko/IR/Ops/PikoApproximationOps.td"
