// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// LLVM IR to code for this machine, just in time.

#ifndef PIKO_TARGET_JIT_H
#define PIKO_TARGET_JIT_H

#include "llvm/ExecutionEngine/Orc/LLJIT.h"
#include "llvm/ExecutionEngine/Orc/ThreadSafeModule.h"

#include <memory>

namespace piko {

/// Code in memory. The runtime's functions, OpenMP's and those of the C and C++
/// libraries are the process's own.
class JITCode {
public:
  /// Optimises a module for this machine and compiles it.
  static llvm::Expected<std::unique_ptr<JITCode>>
  create(std::unique_ptr<llvm::Module> module,
         std::unique_ptr<llvm::LLVMContext> context);

  /// The address of a function, by its name.
  template <typename Function>
  llvm::Expected<Function *> lookup(llvm::StringRef name) {
    auto address = jit->lookup(name);
    if (!address)
      return address.takeError();
    return address->toPtr<Function *>();
  }

private:
  std::unique_ptr<llvm::orc::LLJIT> jit;
};

} // namespace piko

#endif // PIKO_TARGET_JIT_H
