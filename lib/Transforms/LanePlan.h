// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which operations of a loop over primitives can run ahead, for many primitives
// side by side.

#ifndef PIKO_LIB_TRANSFORMS_LANEPLAN_H
#define PIKO_LIB_TRANSFORMS_LANEPLAN_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"
#include "llvm/ADT/SetVector.h"

#include <vector>

namespace piko {

struct LaneBranch;

/// The loops of kernels that are over the primitives of a cell.
llvm::SmallVector<mlir::scf::ForOp>
findLoopsOverPrimitives(PipelineOp pipeline);

/// What the lanes of a loop over primitives are given, if that is known.
std::optional<LaneMapping> getLaneMapping(mlir::scf::ForOp loop);

/// What of a block runs ahead.
struct LanePlan {
  mlir::Block *block = nullptr;
  /// In the order of the block; what they use is outside the loop or in here.
  llvm::SetVector<mlir::Operation *> ahead;
  /// Those of `ahead` that are cheaper to repeat than to keep.
  llvm::SetVector<mlir::Operation *> repeated;
  /// Results of the others that the rest of the block uses.
  llvm::SmallVector<mlir::Value> kept;
  /// Conditional statements of which one side goes on with a plan of its own.
  std::vector<LaneBranch> branches;

  /// How many values are kept, here and in branches.
  int64_t countKept() const;
  /// Calls `visit` with each operation that runs ahead, also inside of others
  /// and in branches.
  void walk(llvm::function_ref<void(mlir::Operation *)> visit) const;
};

struct LaneBranch {
  mlir::scf::IfOp choice;
  unsigned region;
  LanePlan plan;
};

/// As how many operations one in a loop counts whose turns are not known.
constexpr int64_t weightInLoop = 8;

/// What a plan saves and costs.
struct LaneCost {
  int64_t operations = 0; ///< that run ahead; those of inner loops count more
  int64_t values = 0;     ///< that are kept in between

  /// With how many operations what runs ahead is worth what is stored and
  /// loaded for it.
  int64_t getLeast() const;
  bool isWorthwhile() const { return operations >= getLeast(); }
};

/// An operation that cannot run ahead, though all that it needs can, and why.
struct LaneObstacle {
  enum Reason {
    isItself, ///< lanes cannot do it
    holds,    ///< the loop holds `inner`
    carries,  ///< the loop carries what is no number
    differs,  ///< the loop's number of iterations differs between primitives
    isEntered ///< some primitives alone enter the loop
  };
  mlir::Operation *op;
  Reason reason = isItself;
  mlir::Operation *inner = nullptr;
};

/// Makes the plan of a loop over primitives, and tells how its operations run
/// ahead.
class LanePlanner {
public:
  explicit LanePlanner(mlir::scf::ForOp loop);

  LanePlan run();
  LaneCost getCost(const LanePlan &plan) const;
  /// What keeps most operations from running ahead, in the loop's order.
  llvm::SmallVector<LaneObstacle> getObstacles() const;
  /// What is no number but would have to be kept; null if there is nothing.
  mlir::Value getOther() const { return other; }
  bool readsFixedState(mlir::Operation *op) const;

  mlir::scf::ForOp getLoop() const { return loop; }

  /// Whether a value is the same for all primitives.
  bool isInvariant(mlir::Value value) const;
  /// Whether a value is read, from a primitive or from state, before anything
  /// is computed from it.
  bool isFetched(mlir::Value value) const {
    return value.getDefiningOp() && fetched.contains(value.getDefiningOp());
  }
  /// Whether state is read ahead, with tests of indices.
  bool readsState() const;
  /// Of all reads that read the same, the first.
  mlir::Value getFirst(mlir::Value value) const {
    mlir::Value first = same.lookup(value);
    return first ? first : value;
  }
  /// Whether a side of a condition does not run ahead, though the other does.
  bool isRare(mlir::Region &region) const { return rare.contains(&region); }
  /// What asks the memory for what later primitives need.
  llvm::ArrayRef<mlir::Operation *> getPrefetches() const { return prefetches; }

private:
  /// Whether vectors compute an operation.
  bool isComputed(mlir::Operation *op) const;
  LanePlan makePlan(mlir::Block &block);
  void addBranch(LanePlan &plan, mlir::scf::IfOp choice);
  void findPrefetches();
  /// Leaves reads where they are that nothing that runs ahead needs.
  void dropUseless(LanePlan &plan);
  bool isNeeded(mlir::Operation *read, const LanePlan &plan) const;
  void findRepeated(LanePlan &plan);
  void findKept(LanePlan &plan);

  /// Notes that an operation runs ahead, if it can.
  bool take(mlir::Operation *op);
  bool takeCondition(mlir::scf::IfOp choice);
  bool takeLoop(mlir::scf::WhileOp inner);
  /// Tries with these variables of the loop as the same for all primitives; at
  /// the end they are those that can be.
  bool takeLoop(mlir::scf::WhileOp inner, llvm::SmallVector<bool> &uniform);
  bool takeRegion(mlir::Region &region);
  void forget(mlir::Operation *op);
  /// Notes why a loop is not taken.
  void addObstacle(mlir::scf::WhileOp loop, LaneObstacle::Reason reason);
  /// How many operations for vectors would run ahead if an obstacle did.
  int64_t countHeldUp(mlir::Operation *obstacle) const;
  void noteRead(LoadOp load);
  bool isAvailable(mlir::Value value) const;
  /// Whether a value is the same for all primitives and all iterations of inner
  /// loops, and known before them.
  bool isGlobal(mlir::Value value) const;
  /// Whether an operation gives the same for all primitives.
  bool isUniform(mlir::Operation *op) const;
  /// Whether an operation reads what nothing but reads leads to.
  bool isFetch(mlir::Operation *op) const;
  /// Whether a value can lead to what is read.
  bool isAddress(mlir::Value value) const;
  /// Whether the loop only reads an array.
  bool isFixed(mlir::Value array) const;
  /// Whether a side of a condition changes nothing but arrays of its own, so
  /// that it may run before what stands in front of it.
  bool isPrivate(mlir::Region &region) const;

  mlir::scf::ForOp loop;
  llvm::DenseSet<mlir::StringAttr> written; // state
  /// Variables and results of inner loops, and those of them that are the same
  /// for all primitives.
  llvm::DenseSet<mlir::Value> variables, uniform;
  int64_t conditions = 0; // around what is taken
  mlir::Value other;      // is no number, but would have to be kept
  std::vector<LaneObstacle> obstacles;
  llvm::DenseSet<mlir::Operation *> taken;
  llvm::DenseSet<mlir::Operation *> invariant; // of them
  llvm::DenseSet<mlir::Operation *> global;    // of those
  llvm::DenseSet<mlir::Operation *> fetched;   // of them
  llvm::DenseSet<mlir::Operation *> addresses; // computed from fetched ones
  llvm::DenseSet<mlir::Operation *> repeated;
  llvm::DenseMap<mlir::Attribute, llvm::SmallVector<LoadOp>> loads;
  llvm::DenseMap<mlir::Value, mlir::Value> same;
  llvm::DenseSet<mlir::Region *> rare;
  llvm::SmallVector<mlir::Operation *> prefetches;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEPLAN_H
