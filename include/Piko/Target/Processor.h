// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The processors that code is made for, by name, and what code for them needs.

#ifndef PIKO_TARGET_PROCESSOR_H
#define PIKO_TARGET_PROCESSOR_H

#include "llvm/ADT/StringRef.h"
#include "llvm/MC/TargetRegistry.h"
#include "llvm/Support/Error.h"
#include "llvm/TargetParser/Triple.h"

#include <string>
#include <vector>

namespace piko {

/// A processor by LLVM's name and the features that are switched on and off
/// beside it.
struct Processor {
  std::string name, features;
  /// What a machine must have to run code for it, of the features that the
  /// runtime can look for (pikort/processor.def), in that order; empty for what
  /// all machines have.
  std::vector<llvm::StringRef> needs = {};
  /// Lanes of a vector: as many numbers of 32 bits as a register holds, where
  /// all that vectors do is there for that width.
  int64_t lanes = 4;
  /// What the runtime calls code for it and `device`, if that is not empty: a
  /// GPU that it needs beside it.
  std::string device = "";

  const std::string &getLabel() const { return device.empty() ? name : device; }
};

/// The machines that TargetOptions::arch stands for, with Linux, or an error if
/// it is none that code is made for.
llvm::Expected<llvm::Triple> resolveTriple(llvm::StringRef arch);

/// LLVM's target of a triple that resolveTriple gave, ready to make code.
llvm::Expected<const llvm::Target *>
initializeTarget(const llvm::Triple &triple);

/// What every machine of the architecture runs.
llvm::StringRef getBaseProcessor(const llvm::Triple &triple);

/// The processor that TargetOptions::cpu stands for, or an error if there is no
/// such processor, of this machine's architecture or of that which is said.
llvm::Expected<Processor> resolveProcessor(llvm::StringRef cpu);
llvm::Expected<Processor> resolveProcessor(llvm::StringRef cpu,
                                           const llvm::Triple &triple);

/// The same for names between commas. Each must be chosen on some machine,
/// where the last one is taken that fits.
llvm::Expected<std::vector<Processor>>
resolveProcessors(llvm::StringRef cpus, const llvm::Triple &triple);

} // namespace piko

#endif // PIKO_TARGET_PROCESSOR_H
