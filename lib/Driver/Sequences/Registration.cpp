// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The dialects of every tool.

#include "Piko/Driver/Registration.h"

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/DeepStack.h"
#include "Sequences/SequenceParts.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/ControlFlow/IR/ControlFlow.h"
#include "mlir/Dialect/DLTI/DLTI.h"
#include "mlir/Dialect/Func/IR/FuncOps.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/LLVMDialect.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/OpenMP/OpenMPDialect.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/UB/IR/UBOps.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"
#include "mlir/Target/LLVMIR/Dialect/Builtin/BuiltinToLLVMIRTranslation.h"
#include "mlir/Target/LLVMIR/Dialect/GPU/GPUToLLVMIRTranslation.h"
#include "mlir/Target/LLVMIR/Dialect/LLVMIR/LLVMToLLVMIRTranslation.h"
#include "mlir/Target/LLVMIR/Dialect/OpenMP/OpenMPToLLVMIRTranslation.h"

using namespace mlir;
using namespace piko;

void piko::registerPikoDialects(DialectRegistry &registry) {
  registry
      .insert<PikoDialect, DLTIDialect, LLVM::LLVMDialect, arith::ArithDialect,
              cf::ControlFlowDialect, func::FuncDialect, gpu::GPUDialect,
              math::MathDialect, memref::MemRefDialect, omp::OpenMPDialect,
              scf::SCFDialect, ub::UBDialect, vector::VectorDialect>();
  registerBuiltinDialectTranslation(registry);
  registerGPUDialectTranslation(registry);
  registerLLVMDialectTranslation(registry);
  registerOpenMPDialectTranslation(registry);
  registerGPUDialects(registry);
}

static DialectRegistry makeRegistry() {
  DialectRegistry registry;
  piko::registerPikoDialects(registry);
  return registry;
}

piko::PikoContext::PikoContext()
    : MLIRContext(makeRegistry(),
                  canUseThreads() ? Threading::ENABLED : Threading::DISABLED) {}
