// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// All of the dialect, for its reference document.

include "Piko/Dialect/Piko/IR/PikoOps.td"
include "Piko/Dialect/Piko/IR/PikoCheckOps.td"
include "Piko/Dialect/Piko/IR/PikoCountOps.td"
include "Piko/Dialect/Piko/IR/PikoFixedOps.td"
include "Piko/Dialect/Piko/IR/PikoCPUOps.td"
include "Piko/Dialect/Piko/IR/PikoProgramOps.td"
include "Piko/Dialect/Piko/IR/PikoGPUOps.td"
include "Piko/Dialect/Piko/IR/PikoApproximationOps.td"
