// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// NVIDIA's assembler, which makes machine code of PTX. Nothing needs it: a
// device's driver has one, too.

#ifndef PIKO_TARGET_ASSEMBLER_H
#define PIKO_TARGET_ASSEMBLER_H

#include "llvm/ADT/ArrayRef.h"
#include "llvm/ADT/StringRef.h"
#include "llvm/Support/Error.h"

#include <string>

namespace piko {

/// The path of ptxas: on PATH, in $CUDA_HOME/bin, or in the toolkit's customary
/// folder; empty if there is none.
std::string findAssembler();

/// Tells an assembler from another one, or from another version, without
/// running it.
std::string getAssemblerIdentity(llvm::StringRef assembler);

struct Assembly {
  std::string cubin;  ///< An ELF file.
  std::string report; ///< What `ptxas -v` prints.
};

/// Assembles PTX for a chip such as sm_90, or only those of its kernels that
/// are named; an error with the assembler's own text if it refuses.
llvm::Expected<Assembly> assemble(llvm::StringRef assembler,
                                  llvm::StringRef ptx, llvm::StringRef chip,
                                  llvm::ArrayRef<std::string> kernels = {});

/// Each toolkit leaves out chips that the one before it knew.
bool knowsChip(llvm::StringRef assembler, llvm::StringRef chip);

} // namespace piko

#endif // PIKO_TARGET_ASSEMBLER_H
