// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The key of a selection and the position of a primitive as words of 64 bits:
// atomic minima of them say which primitive is first for each pixel, and that
// one keeps what it has.

#ifndef PIKO_LIB_TRANSFORMS_SELECTIONWORDS_H
#define PIKO_LIB_TRANSFORMS_SELECTIONWORDS_H

#include "Reductions/PixelSelection.h"

namespace piko {

/// The words, of 64 bits, that a selection is by.
class SelectionWords {
public:
  explicit SelectionWords(const Selection &selection);
  /// Whether words of one launch may stay for the next one, of primitives that
  /// follow: what is selected then is before what the pixel keeps by its key
  /// alone, so that its word is less. A second word may be greater.
  bool mayStay() const { return size() == 1 && !key.last; }
  /// How many there are: a pass for each.
  int64_t size() const { return int64_t(parts.size()); }
  /// Declares an image for each, as large as that of the key.
  void createImages(PipelineOp pipeline);
  llvm::ArrayRef<ImageOp> getImages() const { return images; }

  /// Makes of a site in pass `pass`, or a copy of it, what finds the least
  /// word there among those whose words before are the least; nothing is kept.
  void reduce(const Selection::Site &site, int64_t pass) const;
  /// Makes of a site what keeps the numbers of the primitive that is first.
  void resolve(const Selection::Site &site) const;
  /// Makes stores of what is carried after it.
  static void resolveCarried(UpdateOp update);

private:
  /// A number of the key, or the position; the more significant ones first.
  struct Part {
    std::optional<KeyNumber> number;
    unsigned width;
  };
  llvm::SmallVector<mlir::Value> compute(mlir::OpBuilder &builder,
                                         UpdateOp update,
                                         llvm::ArrayRef<mlir::Value> numbers,
                                         mlir::Value prim) const;

  SelectionKey key;
  llvm::SmallVector<llvm::SmallVector<Part>> parts; ///< Of each word.
  mlir::StringAttr keyImage;
  llvm::SmallVector<ImageOp> images;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_SELECTIONWORDS_H
