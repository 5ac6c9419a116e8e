// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the report on a pipeline says of its kernels on a GPU.

#ifndef PIKO_LIB_DRIVER_EXPLAINKERNELS_H
#define PIKO_LIB_DRIVER_EXPLAINKERNELS_H

#include "Piko/Analysis/KernelTraffic.h"
#include "Piko/Conversion/UnitOrder.h"
#include "Piko/Driver/Options.h"

namespace piko {

/// Makes PTX of a module's kernels and writes what they take of the chip.
llvm::LogicalResult explainResources(mlir::ModuleOp module,
                                     llvm::StringRef pipeline,
                                     const GPUOptions &gpu, int optLevel,
                                     llvm::raw_ostream &out);

/// How the blocks of a kernel's grid come to their units.
struct KernelUnits {
  std::string kernel;
  UnitOrder order;
};
void explainUnits(llvm::ArrayRef<KernelUnits> kernels, llvm::raw_ostream &out);

/// Writes what kernels read and write.
void explainTraffic(llvm::ArrayRef<KernelTraffic> kernels,
                    llvm::raw_ostream &out);

} // namespace piko

#endif // PIKO_LIB_DRIVER_EXPLAINKERNELS_H
