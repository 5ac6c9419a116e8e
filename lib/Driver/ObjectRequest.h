// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the cache calls an object.

#ifndef PIKO_LIB_DRIVER_OBJECTREQUEST_H
#define PIKO_LIB_DRIVER_OBJECTREQUEST_H

#include "Cache/CompilerIdentity.h"
#include "Piko/Driver/ObjectCompiler.h"
#include "Piko/Target/Processor.h"

#include "llvm/ADT/ArrayRef.h"
#include "llvm/Support/VirtualFileSystem.h"

namespace piko {

/// All that decides what is compiled, but for what is read from files.
std::string makeObjectRequest(const ObjectOptions &options,
                              llvm::ArrayRef<Processor> processors,
                              llvm::vfs::FileSystem &files,
                              CompilerPart part = CompilerPart::All);

} // namespace piko

#endif // PIKO_LIB_DRIVER_OBJECTREQUEST_H
