// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the pixels of later rows refer to is asked for ahead of time.

#ifndef PIKO_LIB_TRANSFORMS_PREFETCHROWS_H
#define PIKO_LIB_TRANSFORMS_PREFETCHROWS_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// Of a loop over rows around one over pixels: asks for the elements of buffers
/// whose places are read from memory, in stages.
void prefetchRows(mlir::scf::ForOp rows, mlir::scf::ForOp pixels);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_PREFETCHROWS_H
