// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Machine code in this process.

#ifndef PIKO_TARGET_JIT_H
#define PIKO_TARGET_JIT_H

#include "Piko/Driver/Options.h"

#include "llvm/ExecutionEngine/Orc/LLJIT.h"

#include <memory>

namespace piko {

/// Code in memory. The runtime's functions, OpenMP's and those of the C and C++
/// libraries are the process's own, and this compiler's.
class JITCode {
public:
  /// What Piko is built with: pipelines that run with its runtime should be
  /// instrumented for it, too.
  static Sanitizer getSanitizer();

  /// Links objects that generateCode made for this machine; empty ones are
  /// none.
  static llvm::Expected<std::unique_ptr<JITCode>>
  load(llvm::ArrayRef<llvm::StringRef> objects);

  /// The address of a function or a variable, by its name.
  template <typename T> llvm::Expected<T *> lookup(llvm::StringRef name) {
    auto address = jit->lookup(name);
    if (!address)
      return address.takeError();
    return address->toPtr<T *>();
  }

private:
  std::unique_ptr<llvm::orc::LLJIT> jit;
};

} // namespace piko

#endif // PIKO_TARGET_JIT_H
