// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where a compilation finds its files.

#ifndef PIKO_LIB_DRIVER_OPENFILES_H
#define PIKO_LIB_DRIVER_OPENFILES_H

#include "Piko/Driver/Options.h"

#include "llvm/Support/VirtualFileSystem.h"

namespace piko {

/// The disk, where the user's text in memory is a file among the others.
llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem>
openFiles(const CompileOptions &source);

} // namespace piko

#endif // PIKO_LIB_DRIVER_OPENFILES_H
