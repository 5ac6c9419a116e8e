// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The sequences of passes that the tools share. Each is registered for
// piko-opt under the name that its comment gives.

#ifndef PIKO_DRIVER_SEQUENCES_H
#define PIKO_DRIVER_SEQUENCES_H

#include "Piko/Driver/CPUOptions.h"
#include "Piko/Driver/CheckOptions.h"
#include "Piko/Driver/GPUOptions.h"
#include "Piko/Driver/SynthesisOptions.h"

#include "mlir/Pass/PassManager.h"

namespace piko {

/// `piko-add-checks`: the authored level in checking mode.
void addCheckSequence(mlir::OpPassManager &passes, const CheckOptions &options);

/// `piko-synthesize`: from the authored to the kernels level.
void addSynthesisSequence(mlir::OpPassManager &passes,
                          const SynthesisOptions &options = {});

/// `piko-to-machine`: from the kernels to the machine level.
void addMachineSequence(mlir::OpPassManager &passes,
                        const SynthesisOptions &options = {});

/// `piko-to-units`: from there to loops over units of work, for the CPU; does
/// nothing to what has gone through it.
void addUnitSequence(mlir::OpPassManager &passes);

/// `piko-to-cpu`: from the machine level to scf, arith, omp and llvm.
void addCPUSequence(mlir::OpPassManager &passes,
                    const SynthesisOptions &options = {},
                    const CPUOptions &cpu = {});

/// The part of it that is the same for all processors.
void addScalarSequence(mlir::OpPassManager &passes,
                       const SynthesisOptions &options);

/// The rest of it, from piko-narrow-integers on.
void addVectorSequence(mlir::OpPassManager &passes,
                       const SynthesisOptions &options, const CPUOptions &cpu);

/// `piko-cpu-to-llvm`: from there to the llvm dialect (and omp) alone.
void addLLVMSequence(mlir::OpPassManager &passes);

/// `piko-to-grids`: from the machine level, mapped to threads, to grids of
/// blocks; also of one pipeline.
void addGridSequence(mlir::OpPassManager &passes,
                     const SynthesisOptions &synthesis = {});

/// `piko-to-gpu`: from the machine level to kernels in a `gpu.module`, and
/// functions that launch them. Where the options say so, these launch them on
/// the emulator, and kernels are in the llvm and nvvm dialects.
void addGPUSequence(mlir::OpPassManager &passes, const GPUOptions &options,
                    const SynthesisOptions &synthesis = {});

/// From kernels in a `gpu.module` to such that the emulator or a device runs,
/// as the options say.
void addLaunchSequence(mlir::OpPassManager &passes, const GPUOptions &options);

/// `piko-gpu-to-nvvm`: the kernels from there to the llvm and nvvm dialects.
void addNVVMSequence(mlir::OpPassManager &passes);

void registerSequences();

} // namespace piko

#endif // PIKO_DRIVER_SEQUENCES_H
