// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the kernels of a module take of a GPU.

#ifndef PIKO_TARGET_KERNELRESOURCES_H
#define PIKO_TARGET_KERNELRESOURCES_H

#include "llvm/IR/Module.h"
#include "llvm/Support/Error.h"

#include <optional>
#include <string>
#include <vector>

namespace piko {

struct KernelResources {
  std::string kernel;
  int64_t threads = 0;     ///< Of a block.
  int64_t blockMemory = 0; ///< Shared memory of a block, bytes.
  /// What NVIDIA's assembler says, where there is one; a thread's, in bytes but
  /// for registers.
  struct Assembled {
    int64_t registers = 0, stack = 0, spillStores = 0, spillLoads = 0;
  };
  std::optional<Assembled> assembled;

  /// The part of the threads which a multiprocessor of `chip` can have at the
  /// same time that it has of this kernel: by its registers, block memory and
  /// threads. None where the registers, or the chip's limits, are not known.
  std::optional<double> getOccupancy(llvm::StringRef chip) const;
};

/// How many threads a multiprocessor of a chip can have at the same time; none
/// if the chip's limits are not known.
std::optional<int64_t> getResidentThreads(llvm::StringRef chip);

struct AssembledKernels {
  std::vector<KernelResources> kernels; ///< In the order of the module.
  std::string cubin;
};

/// Assembles `ptx`, which was made of the module. A kernel that spills
/// registers may have more of them, if it spills none then, a multiprocessor
/// has room for at least three quarters of the threads, and it calls no
/// function.
llvm::Expected<AssembledKernels> assembleKernels(llvm::StringRef assembler,
                                                 const llvm::Module &kernels,
                                                 llvm::StringRef ptx,
                                                 llvm::StringRef chip);

struct KernelReport {
  std::vector<KernelResources> kernels; ///< In the order of the module.
  std::string source; ///< "ptxas", or why nothing was assembled.
};

/// The resources of each kernel. `ptx` was made of the module for `chip`. An
/// error if the assembler refuses it, though it knows the chip.
llvm::Expected<KernelReport> measureKernels(const llvm::Module &kernels,
                                            llvm::StringRef ptx,
                                            llvm::StringRef chip);

} // namespace piko

#endif // PIKO_TARGET_KERNELRESOURCES_H
