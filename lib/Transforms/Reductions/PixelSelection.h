// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Updates that select, for each pixel, what is first by a key, and carry along
// what else there is to know of it: arg-min reductions.

#ifndef PIKO_LIB_TRANSFORMS_PIXELSELECTION_H
#define PIKO_LIB_TRANSFORMS_PIXELSELECTION_H

#include "Support/BinOwner.h"

#include "llvm/ADT/SetVector.h"

#include <vector>

namespace piko {

/// Whether a value depends on what the pixel was that an update changes.
bool dependsOnPixel(mlir::Value value, UpdateOp update);

/// A number of a pixel that is compared with a new one.
struct KeyNumber {
  unsigned number;            ///< Of the record, fields in order.
  llvm::StringRef comparison; ///< Where new is before old: "olt", "sgt" etc.
  bool operator==(const KeyNumber &) const = default;
};

/// What a pixel is selected by.
struct SelectionKey {
  llvm::SmallVector<KeyNumber> numbers; ///< The most significant first.
  bool last = false;                    ///< Of equal keys the last is kept.
  bool operator==(const SelectionKey &) const = default;
};

/// The images that a kernel selects pixels of by one key.
struct Selection {
  struct Image {
    mlir::StringAttr name;
    llvm::SmallVector<int64_t> kept; ///< The numbers that change.
    bool operator==(const Image &) const = default;
  };
  /// A place at which it does.
  struct Site {
    UpdateOp update;
    /// In the update, whether the new numbers are kept; null = always.
    mlir::Value condition;
    bool outcome = true; ///< Of the condition, where they are.
  };
  SelectionKey key;
  /// The first one has the key, the others are overwritten where it changes.
  llvm::SmallVector<Image> images;
  llvm::SmallVector<Site> sites;
  /// What is overwritten after them, where they have kept new numbers.
  llvm::SmallVector<UpdateOp> carried;
};

/// Appends the names of its images.
void appendImages(mlir::InFlightDiagnostic &remark, const Selection &selection);

/// Whether primitives that are in order are all in one bin.
bool hasOneOrderedBin(StageOp stage);

/// Finds whether all that a kernel does to pixels is to select them.
class SelectionFinder {
public:
  /// `others` are images that the kernel updates in ways whose order does not
  /// show.
  SelectionFinder(KernelOp kernel,
                  const llvm::SetVector<mlir::StringAttr> &others)
      : kernel(kernel), others(others) {}
  /// False if there is a reason.
  bool find();

  std::vector<Selection> selections;
  std::optional<Reason> reason;

private:
  bool refuse(mlir::Operation *at, const char *why);
  bool checkOthers();
  bool addSite(UpdateOp update);
  bool merge(const Selection &selection);
  bool findCarried(Selection &selection);
  bool visitUses(mlir::Value isKept, bool outcome,
                 llvm::SmallVectorImpl<UpdateOp> &carried);
  bool visitBranch(mlir::Region &region,
                   llvm::SmallVectorImpl<UpdateOp> *carried);
  bool isFree(mlir::Operation *op, mlir::Region &region) const;

  KernelOp kernel;
  const llvm::SetVector<mlir::StringAttr> &others;
  llvm::SmallVector<UpdateOp> updates;
  llvm::DenseSet<mlir::StringAttr> names;  ///< Of all images.
  llvm::DenseSet<mlir::Operation *> after; ///< Updates that are carried.
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_PIXELSELECTION_H
