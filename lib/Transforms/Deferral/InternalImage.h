// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Images that a pipeline does not have in the text.

#ifndef PIKO_LIB_TRANSFORMS_INTERNALIMAGE_H
#define PIKO_LIB_TRANSFORMS_INTERNALIMAGE_H

#include "Piko/Dialect/Piko/IR/Piko.h"

namespace piko {

/// An internal image after another one of its rank, with numbers for each
/// pixel: a record `piko.` and `what`, after which the image and its fields are
/// called, too. `clear` is what it is cleared to, or null.
ImageOp createInternalImage(ImageOp image, llvm::StringRef what,
                            llvm::ArrayRef<mlir::Type> types,
                            mlir::ArrayAttr clear);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_INTERNALIMAGE_H
