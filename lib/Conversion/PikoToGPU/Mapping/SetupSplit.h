// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which work on a primitive is its setup, and what its pixels need of that.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_SETUPSPLIT_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_SETUPSPLIT_H

#include "PikoToGPU/Mapping/PixelNest.h"

#include "llvm/ADT/SetVector.h"

namespace piko {

/// How much of the setup is taken out of the loop over pixels.
enum class Extent { All, Fields };

class SetupSplit {
public:
  /// Of a loop over primitives. `own` is what differs between threads; what is
  /// in the blocks `rare` is done elsewhere.
  SetupSplit(mlir::Operation *items, Extent extent,
             llvm::ArrayRef<mlir::Value> own = {},
             llvm::ArrayRef<mlir::Block *> rare = {});

  /// Whether an operation is left to the pixels.
  bool isForPixels(mlir::Operation *op) const { return pixels.contains(op); }
  /// Whether it cannot be done for another primitive at the same time.
  bool mustKeep(mlir::Operation *op) const;
  bool isInSetup(mlir::Value value) const;
  /// What the setup of one primitive leaves.
  int64_t countBytes() const;

  llvm::SetVector<mlir::Value> shared; ///< What pixels need.

  /// As it is in memory: an i1 has no size of its own there.
  static mlir::Type getStorage(mlir::Type type) {
    return type.isInteger(1) ? mlir::IntegerType::get(type.getContext(), 8)
                             : type;
  }

private:
  void findPixelWork();
  bool needsPixels(mlir::Operation *op) const;
  bool hasWorkForPixels(mlir::Operation *op) const;
  bool isCommonIf(mlir::Operation *op) const;
  void findShared();
  void computeAgain();
  /// All operations but those that are rare.
  void walk(llvm::function_ref<void(mlir::Operation *)> visit) const;

  mlir::Operation *items;
  Extent extent;
  llvm::DenseSet<mlir::Block *> rare;
  llvm::DenseSet<mlir::Value> own;
  llvm::DenseSet<mlir::Operation *> pixels;
  llvm::DenseSet<mlir::Operation *> both; ///< As cheap as a load.
};

/// The pixels of a group of primitives as one space, in shared memory.
struct PixelGroup {
  PixelGroup(int64_t threads, StageOp stage);

  int64_t threads;
  int64_t size;       ///< Most primitives of a group.
  int64_t words;      ///< Of 32 bits, in the mask of a pixel.
  int64_t pixels = 1; ///< Of a bin.

  /// Whether its numbers have the bits for all pixels.
  bool canCount() const {
    return pixels < (1 << 16) && size * pixels < (1 << pixelBits);
  }
  /// Whether the block has room for it, and the multiprocessor for such blocks,
  /// where the setup of a primitive leaves so much.
  bool fits(int64_t setupBytes) const;

  /// Bits of a number of pixels, in the word that has that of primitives, too.
  static constexpr int64_t pixelBits = 24;
};

/// Why threads cannot take the pixels of a nest by groups, however much memory
/// that takes, if they cannot: `split` is without what is rare.
std::optional<Obstacle> findObstacleToGroups(mlir::Operation *items,
                                             const SetupSplit &split,
                                             PixelNest &nest,
                                             const PixelGroup &group);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_MAPPING_SETUPSPLIT_H
