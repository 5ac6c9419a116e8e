// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The parts of convert-piko-to-gpu.

#ifndef PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
#define PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H

#include "PikoToGPU/Mapping/WorkLegality.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "pikort/grid.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"
#include "llvm/ADT/MapVector.h"

namespace piko {

/// Fails, with an error, at what no grid of blocks can do.
llvm::LogicalResult checkGridLimits(KernelOp kernel);

/// Whether an operation, or one inside it, is one of those.
template <typename Predicate>
bool contains(mlir::Operation *op, Predicate predicate) {
  return op
      ->walk([&](mlir::Operation *inner) {
        return predicate(inner) ? mlir::WalkResult::interrupt()
                                : mlir::WalkResult::advance();
      })
      .wasInterrupted();
}

/// How the threads of a block share the pixels of a bin: a tile of as many
/// pixels as there are threads is laid over the domain again and again.
struct ThreadTile {
  /// `threads` is a power of two; it is split evenly over the dimensions, the
  /// first ones before the others.
  ThreadTile(int64_t threads, int64_t rank);

  /// Powers of two, so that arithmetic that wraps cannot change whose a pixel
  /// is.
  llvm::SmallVector<int64_t> extents;
  /// The thread's place in the tile.
  llvm::SmallVector<mlir::Value> place;
};

struct Emitter;

/// Lets no integer go from pixel to pixel that is another function of the
/// pixel.
void useClosedFormsInPixelLoops(mlir::Operation *items);

/// Leaves to each thread the updates of its own pixels, and what follows from
/// them, in a loop over primitives that all threads run. An error where
/// findObstacleToSharing finds one.
llvm::LogicalResult sharePixels(mlir::scf::ForOp items, const ThreadTile &tile);

struct GridMemory;
/// Lets each thread of a block compute what depends on a primitive alone for
/// another one, in groups of as many as there are threads, in a loop whose
/// pixels they share.
void shareSetup(mlir::scf::ForOp items, const ThreadTile &tile,
                GridMemory &memory);

/// Whether the parallel loops of a loop over primitives are all in branches
/// that are rare (RareBranches.cpp), and there are such branches.
bool hasRareIterationsOnly(mlir::Operation *loop);
/// Makes regions of their own of the rare branches of a loop that threads
/// share, which become functions; how many.
int64_t setRareBranchesApart(mlir::scf::ForOp loop);

/// Puts a second launch after that of `memory`, for units in which primitives
/// of a shared loop are rare; what that has. Nothing where it would show.
std::optional<GridMemory> leaveRareRounds(mlir::scf::ForOp loop,
                                          GridMemory &memory);
/// Lets a launch leave units, or go on with them; after mapBlock.
void finishRareRounds(GridMemory &memory);

/// What threads that share the iterations of a loop put off, in shared memory
/// (CompactedWork.cpp).
struct WorkQueue {
  int64_t capacity, threads;
  mlir::Value count; ///< How many wait.
  /// Of each class of length: how many wait, and the place of the first.
  mlir::Value lengths, starts;
  mlir::Value classes; ///< Of those that wait: class, and place in that above.
  mlir::Value order;   ///< The longest first.
  /// A loop over those that wait, of which each thread takes some.
  mlir::scf::ForOp work;

  /// After a round of iterations, in which as many as there are threads may
  /// have come: does the work if there may be no room for another round, or
  /// `isLast`.
  void drain(mlir::OpBuilder &builder, mlir::Value isLast);
  void clear(Emitter &b, mlir::Value thread);
};

/// Where threads share primitives in rounds, and leave a unit to a second
/// launch before a round with a rare one (RareRounds.cpp).
struct RareRounds {
  mlir::scf::ForOp buckets, loop; ///< Over the unit's buckets, and primitives.
  /// What becomes of the loop: rounds, and in one a thread's iteration.
  mlir::scf::ForOp rounds;
  mlir::scf::IfOp iteration;
  /// Of the first launch, in shared memory: whether a thread has come to a
  /// rare primitive, and whether the unit has been left.
  mlir::Value found, left;
};

/// What a grid has for what its threads emit (piko.gpu.append_buffers).
struct GridMemory {
  mlir::gpu::LaunchOp launch;
  mlir::Value log;
  mlir::Value buffers;          ///< A thread's.
  mlir::Value kept, flushWords; ///< The block's.
  mlir::Attribute stage;        ///< The kernel's.
  /// Producer and port of each local edge.
  llvm::SmallVector<std::pair<mlir::FlatSymbolRefAttr, int64_t>> locals;
  /// What iterations of loops that threads share put off.
  llvm::MapVector<mlir::Operation *, WorkQueue> queues;
  std::optional<RareRounds> rare;
  /// Loops over primitives that the first thread does in order, and emits in.
  llvm::DenseSet<mlir::Operation *> ordered;

  int64_t getWords();
  /// Where the words of a local edge begin.
  int64_t getLocalBase(LocalBinOp local);
  void flush(mlir::OpBuilder &builder);
  void clearAppendBuffers(mlir::OpBuilder &builder);
  /// Puts the append buffers of threads, which are many numbers, into shared
  /// memory.
  void keepAppendBuffersInBlock(int64_t threads);
  /// Which primitive errors are about from here on.
  void setPosition(mlir::OpBuilder &builder, mlir::Value position);
  void setLocalCount(mlir::OpBuilder &builder, LocalBinOp local,
                     mlir::Value count);
  mlir::Value getLocalCount(mlir::OpBuilder &builder, LocalBinOp local);
};

/// Puts off what a loop whose iterations threads share does in an inner loop by
/// atomics alone, whose order nobody sees. False where there is nothing of
/// that kind.
bool compactWork(mlir::scf::ForOp loop, GridMemory &memory, int64_t threads);
/// Where a block begins; after mapBlock.
void beginQueues(GridMemory &memory);

/// Maps a block's work to its threads: the first thread does what has effects,
/// loops that are marked are shared, iterations of parallel loops are threads,
/// and all else is done by all threads alike.
llvm::LogicalResult mapBlock(GridMemory &memory);

/// Memory that the threads of a block share.
mlir::Value addSharedMemory(mlir::gpu::LaunchOp launch,
                            llvm::ArrayRef<int64_t> shape, mlir::Type type);

/// Turns a parallel loop of at most as many iterations as the block has threads
/// into what each of these does. What a thread alone does is under tests,
/// which `ofOne` gets; arrays of one iteration go to `ownArrays`.
struct ThreadOperations {
  llvm::DenseSet<mlir::Operation *> ofOne, ownArrays;
};
llvm::LogicalResult mapIterations(ParallelForOp loop,
                                  mlir::gpu::LaunchOp launch,
                                  ThreadOperations &made);

/// What every GPU's blocks have.
constexpr int64_t maxThreads = 1024, maxSharedBytes = 48 << 10, warpSize = 32;

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOGPU_PIKOTOGPU_H
