// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The passes of tools that name them.

#include "Piko/Driver/Registration.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Driver/Sequences.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Conversion/MathToLLVM/MathToLLVM.h"
#include "mlir/Conversion/OpenMPToLLVM/ConvertOpenMPToLLVM.h"
#include "mlir/Conversion/ReconcileUnrealizedCasts/ReconcileUnrealizedCasts.h"
#include "mlir/Conversion/SCFToControlFlow/SCFToControlFlow.h"
#include "mlir/Conversion/UBToLLVM/UBToLLVM.h"
#include "mlir/Conversion/VectorToLLVM/ConvertVectorToLLVMPass.h"
#include "mlir/Dialect/GPU/Transforms/Passes.h"
#include "mlir/Transforms/Passes.h"

using namespace mlir;
using namespace piko;

void piko::registerPikoPasses() {
  registerPikoTransformsPasses();
  registerPikoConversionPasses();
  registerSequences();
  registerTransformsPasses();
  // One by one: upstream's header for all conversions costs seconds to compile.
  registerPass([] { return createConvertMathToLLVMPass(); });
  registerPass([] { return createConvertVectorToLLVMPass(); });
  registerPass([] { return createGpuKernelOutliningPass(); });
  registerPass([] { return createGpuLaunchSinkIndexComputationsPass(); });
  registerPass([] { return createConvertOpenMPToLLVMPass(); });
  registerPass([] { return createReconcileUnrealizedCastsPass(); });
  registerPass([] { return createSCFToControlFlowPass(); });
  registerPass([] { return createUBToLLVMConversionPass(); });
}
