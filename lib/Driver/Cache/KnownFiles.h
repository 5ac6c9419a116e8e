// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The disk, whose small files a process reads once: each pipeline that a tool
// compiles asks for the same headers.

#ifndef PIKO_LIB_DRIVER_KNOWNFILES_H
#define PIKO_LIB_DRIVER_KNOWNFILES_H

#include "llvm/Support/VirtualFileSystem.h"

namespace piko {

/// What a file holds is kept as long as the process lives, and given again as
/// long as the disk says that it is the same file with the same size and time
/// of its last change. Any thread may ask.
class KnownFiles : public llvm::vfs::ProxyFileSystem {
public:
  KnownFiles() : ProxyFileSystem(llvm::vfs::getRealFileSystem()) {}

  llvm::ErrorOr<std::unique_ptr<llvm::vfs::File>>
  openFileForRead(const llvm::Twine &path) override;
};

} // namespace piko

#endif // PIKO_LIB_DRIVER_KNOWNFILES_H
