// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Groups of primitives whose pixels the threads of a block share: setup and
// coverage are in CollapsedPixels.cpp, updates and what is rare in
// PixelUpdates.cpp.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELGROUPS_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELGROUPS_H

#include "PikoToGPU/Emitter.h"
#include "PikoToGPU/Pixels/CollapsedPixels.h"
#include "PikoToGPU/Pixels/ItemSetup.h"
#include "PikoToGPU/Pixels/PixelSharing.h"

#include "llvm/Support/MathExtras.h"

namespace piko {

class CollapsedPixels {
public:
  CollapsedPixels(mlir::scf::ForOp items, PixelNest &nest, StageOp stage,
                  const ThreadTile &tile, GridMemory &memory)
      : items(items), nest(nest), stage(stage), tile(tile), memory(memory),
        launch(memory.launch) {
    int64_t size = 1;
    for (int64_t side : tile.extents)
      size *= side;
    PixelGroup space(size, stage);
    threads = size, group = space.size;
    words = space.words, pixels = space.pixels;
  }
  mlir::FailureOr<RareSite> run();

private:
  /// Of a primitive, for each dimension: where its loop begins, and how many
  /// pixels it counts.
  struct Side {
    mlir::Value lo, extent;
  };
  using Box = llvm::SmallVector<Side, 3>;

  mlir::LogicalResult split();
  void clear();
  void createGroups(ItemSetup &setup);
  void note(mlir::Operation *op, mlir::OpBuilder &at,
            const mlir::IRMapping &mapping);
  void addBox(Emitter &b, mlir::Value size);
  void findCovered(Emitter &b);
  mlir::Value findSlot(Emitter &b, mlir::Value count, mlir::Value first);
  llvm::SmallVector<mlir::Value> findFirst(Emitter &b, mlir::Value count,
                                           mlir::Value first);
  llvm::SmallVector<mlir::Value> testPixel(Emitter &b, mlir::ValueRange now);
  void addPixel(Emitter &b, mlir::Value item, llvm::ArrayRef<mlir::Value> cell);
  std::pair<mlir::Value, mlir::Value> takePixel(Emitter &b, mlir::Value at);
  void updatePixels(Emitter &b);
  void updatePixel(Emitter &b, mlir::Value pixel, mlir::Value bit);
  mlir::Value resume(Emitter &b);
  mlir::Value runRare(Emitter &b);
  Box cloneBox(Emitter &b, mlir::IRMapping &mapping);
  void mapCounters(mlir::IRMapping &mapping, llvm::ArrayRef<mlir::Value> cell);

  mlir::scf::ForOp items, rare;
  PixelNest &nest;
  StageOp stage;
  const ThreadTile &tile;
  GridMemory &memory;
  mlir::gpu::LaunchOp launch;
  int64_t threads, group, words, pixels; ///< As PixelGroup has them.
  bool isRareForOne = false;             ///< Its pixels cannot be shared.
  /// By dimension, as its loop counts.
  llvm::SmallVector<mlir::Value> binLo, binHi;
  mlir::Value thread, base; ///< base: the group's first primitive.
  /// Of the block. The ticket has the boxes in its upper bits, and the pixels
  /// of all of them below.
  mlir::Value ticket, limit, listed, slots, starts, masks, touched, list;
  /// The first rare primitive of the group, when its setup has ended: in shared
  /// memory, where each thread finds what all of them have written.
  mlir::Value until;
  RareSite site;
};

/// What a block on the way to the work has before an operation.
void cloneUntil(Emitter &b, mlir::Block *block, mlir::Operation *end,
                mlir::IRMapping &mapping);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIXELS_PIXELGROUPS_H
