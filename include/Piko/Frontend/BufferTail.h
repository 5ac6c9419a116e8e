// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The end of a memory buffer, which is not copied.

#ifndef PIKO_FRONTEND_BUFFERTAIL_H
#define PIKO_FRONTEND_BUFFERTAIL_H

#include "llvm/Support/MemoryBuffer.h"

namespace piko {

/// What is after the first `begin` bytes of a buffer.
std::unique_ptr<llvm::MemoryBuffer>
dropFront(std::unique_ptr<llvm::MemoryBuffer> buffer, size_t begin);

} // namespace piko

#endif // PIKO_FRONTEND_BUFFERTAIL_H
