// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The log of a grid, and memory of its blocks.

#include "Piko/Dialect/Piko/IR/PikoGPU.h"

using namespace mlir;
using namespace piko;

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoGPUOps.cpp.inc"
