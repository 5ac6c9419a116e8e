// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Shading that is put off: what the primitives of a bin overwrite pixels with
// is seen of the last one alone, so that most of it may be computed when all of
// them are done, from a few numbers that are kept of each pixel.

#ifndef PIKO_LIB_TRANSFORMS_DEFERRAL_H
#define PIKO_LIB_TRANSFORMS_DEFERRAL_H

#include "Deferral/CommonSlice.h"
#include "Deferral/OverwrittenPixels.h"
#include "Support/BinOwner.h"

namespace piko {

/// What the primitives of a bin overwrite some images with, and which part of
/// that is done later.
class Deferral {
public:
  /// Where it is done: in the bin, after its primitives, or by a kernel of its
  /// own.
  enum class To { Bin, Kernel };

  /// `mayFail` lets reads be done later whose indices are tested then: by a
  /// kernel that knows of no primitive.
  Deferral(BinsOp bins, mlir::Operation *work, llvm::ArrayRef<Site> sites,
           To to, bool mayFail);
  Deferral(BinsOp bins, mlir::Operation *work, llvm::ArrayRef<Site> sites,
           To to)
      : Deferral(bins, work, sites, to, to == To::Bin) {}

  /// Finds what is to be done later; false if it is too little, or if that
  /// cannot be told apart.
  bool findWork();

  llvm::ArrayRef<Site> getSites() const { return sites; }
  mlir::Operation *getWork() const { return work; }
  StageOp getStage() const { return stage; }
  /// The first of what overwrites.
  UpdateOp getFirst() const { return sites.front().updates.front(); }
  /// The last one at a site.
  UpdateOp getLast(size_t site) const;

  /// The images that are overwritten, and the state that is read later.
  llvm::DenseSet<mlir::StringAttr> getImages() const;
  llvm::DenseSet<mlir::StringAttr> getReadState() const;
  LoadOp findFailure() const;

  /// What is kept of a pixel, and in which types.
  llvm::ArrayRef<Counterparts> getKept() const { return slice.getKept(); }
  llvm::SmallVector<mlir::Type> getStoredTypes() const;
  int64_t getBytes() const;
  /// What a site keeps, as it is stored.
  llvm::SmallVector<mlir::Value> store(mlir::OpBuilder &builder,
                                       size_t site) const;
  /// What is stored of a pixel: a number, or, of none, whether there is any, as
  /// an i32.
  using Load = llvm::function_ref<mlir::Value(mlir::ValueRange pixel,
                                              std::optional<size_t> number)>;
  /// A loop over the pixels of a bin of some stage that does the rest.
  void createLoop(mlir::OpBuilder &builder, StageOp owner, mlir::Value bin,
                  Load load) const;

private:
  CommonSlice::Rules makeRules();
  bool isInWork(mlir::Value value) const;
  bool isCoordinate(const Counterparts &values, int64_t dim) const;
  bool isKnown(const Counterparts &values) const;
  bool isFree(mlir::Operation *op) const;
  bool isMovable(mlir::Operation *op) const;
  bool isOfItem(LoadOp load) const;
  bool isShared(mlir::Operation *op) const;
  bool canStore() const;
  void rebuild(mlir::OpBuilder &builder, mlir::ValueRange pixel,
               Load load) const;
  mlir::Value getKnown(mlir::OpBuilder &builder, const Counterparts &values,
                       mlir::ValueRange pixel) const;

  mlir::Value bin;
  mlir::Operation *work;
  llvm::ArrayRef<Site> sites;
  To to;
  bool mayFail;
  mutable StageOp stage;
  llvm::DenseSet<mlir::StringAttr> written; ///< State that the kernel changes.
  bool hasLoops = false;                    ///< Loops are what is worth moving.
  CommonSlice slice;
};

/// Calls `apply` with all that is worth deferring in the bins of a kernel;
/// where it gives a reason, or something else is in the way, a remark says so.
void forEachDeferral(
    KernelOp kernel, BinsOp bins, Deferral::To to,
    llvm::function_ref<std::optional<Reason>(Deferral &)> apply);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_DEFERRAL_H
