// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How the iterations of a parallel loop run as lanes of vectors.

#ifndef PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
#define PIKO_LIB_TRANSFORMS_ITERATIONLANES_H

#include "Piko/Analysis/Uniformity.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseSet.h"
#include "llvm/ADT/SetVector.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace piko {

struct Cycles; // LaneCycles.h

/// What an operation of an iteration becomes.
enum class LaneForm {
  Uniform,   ///< the same for all lanes: stays scalar
  Vector,    ///< the same operation on vectors
  Access,    ///< a gather or a scatter, of state or of an array
  Private,   ///< an array with a column for each lane
  Barrier,   ///< where lanes meet, which they always do
  Structure, ///< control flow, by predication
  Lazy,      ///< no number: made again where a lane needs it
  Serial,    ///< lane by lane
  Ordered    ///< lane by lane, from the first of its kind to the last
};

/// Operations of a block that run lane by lane, in the order of iterations: in
/// their place, or, `late`, after all that vectors do.
struct OrderedGroup {
  mlir::Operation *first = nullptr, *last = nullptr;
  bool late = false;

  explicit operator bool() const { return first; }
  bool contains(mlir::Operation *op) const;
  llvm::SmallVector<mlir::Operation *> getOperations() const;
};

/// A record that lanes emit, and where it is put.
struct LaneRecord {
  AppendOp append;
  AppendBinOp place; ///< or null
  const OrderedGroup *group = nullptr;
};

/// What vectors emit to a port for all lanes: each lane its records, in order.
struct PortEmissions {
  mlir::Value writer;
  int64_t port = 0;
  llvm::SmallVector<LaneRecord> records = {};
};

/// What the operations of an iteration become, each by itself.
class LaneForms {
public:
  /// Why the loop stays as it is, and where; `at` is null if it need not.
  struct Refusal {
    mlir::Operation *at = nullptr;
    std::string why;
  };
  const Refusal &getRefusal() const { return refusal; }
  mlir::scf::ForOp getLoop() const { return loop; }
  /// How many iterations run at once.
  int64_t getLaneCount() const { return laneCount; }
  bool isVarying(mlir::Value value) const {
    return uniformity.isVarying(value);
  }
  /// Whether a value is the iteration's number and what is the same for all.
  bool isLinear(mlir::Value value) const;
  /// The same of a value that grows by one from lane to lane also where it
  /// wraps around: it is not cast from a sum of fewer bits.
  bool isSum(mlir::Value value) const;
  /// Whether an array is so short that lanes access all of it rather than
  /// elements in different places.
  bool isShort(mlir::Value array) const;
  /// Whether an array belongs to an iteration; it has a column for each lane if
  /// it varies.
  bool isPrivate(mlir::Value array) const { return privates.contains(array); }
  /// Whether an operation reads an array, or state, that no iteration changes.
  bool readsFixed(mlir::Operation *op) const;
  LaneForm getForm(mlir::Operation *op) const;
  /// Whether all lanes make the same iterations of an inner loop.
  bool isSharedLoop(mlir::Operation *op) const;
  /// The loops, from the outermost, whose iterations fill vectors together with
  /// the lanes that make them; none if `loop` is not the first of such.
  llvm::SmallVector<mlir::scf::ForOp> getNest(mlir::scf::ForOp loop) const {
    return nests.lookup(loop);
  }
  /// Whether lanes access one element after the other.
  bool isRow(mlir::Operation *op) const;
  /// Whether an operation changes elements side by side of a private copy.
  bool isPrivateRow(mlir::Operation *op) const;
  /// Of a read that is mostly of a row, as its index is linear but for limits,
  /// what must be linear when it runs; else null.
  mlir::Value findLimited(mlir::Operation *op) const;

protected:
  LaneForms(mlir::scf::ForOp loop, int64_t laneCount);
  void refuse(mlir::Operation *at, const llvm::Twine &why) {
    if (!refusal.at)
      refusal = {at, why.str()};
  }
  void findForms();
  /// Gives each lane its own of arrays that they have shared.
  void split(llvm::ArrayRef<mlir::Value> arrays);
  void checkBarriers();

  mutable mlir::scf::ForOp loop; // whose accessors are not const

private:
  void findNests();
  bool canCollapse(mlir::scf::ForOp inner) const;
  void findArrays();
  void findSharedPixels();
  void checkCombination(mlir::Operation *barrier);
  void checkCarried();
  bool isAccess(mlir::Operation *op) const;
  bool isFixed(mlir::Value value) const;
  bool isLimited(mlir::Value value) const;

  int64_t laneCount;
  llvm::SmallVector<Uniformity::Root> roots;
  Uniformity uniformity;
  Refusal refusal;
  llvm::DenseSet<mlir::Value> privates, changed; // arrays
  /// Images that iterations change at pixels which may be the same.
  llvm::DenseSet<mlir::Attribute> shared;
  llvm::DenseSet<mlir::Attribute> written; // state
  llvm::DenseMap<mlir::Operation *, llvm::SmallVector<mlir::scf::ForOp>> nests;
};

/// What of it lanes do one after the other.
class LaneOrder : public LaneForms {
public:
  llvm::ArrayRef<OrderedGroup> getGroups() const { return groups; }
  /// The group that an operation is in, or null.
  const OrderedGroup *findGroup(mlir::Operation *op) const;
  /// What of these operations of a block may be done before the others, in
  /// vectors.
  llvm::SetVector<mlir::Operation *>
  findMovable(llvm::ArrayRef<mlir::Operation *> ops) const;
  /// What of a group lanes do in turns.
  llvm::SetVector<mlir::Operation *> findTurns(const OrderedGroup &group) const;
  llvm::ArrayRef<PortEmissions> getEmissions() const { return emissions; }
  /// Whether an operation is one of the emissions that vectors make.
  bool isEmission(mlir::Operation *op) const { return emitted.contains(op); }
  /// Why lanes take turns to emit, for a remark; or nothing.
  llvm::StringRef explainTurns(mlir::Operation *emission) const;
  /// Whether vectors store the records that lanes emit in their turns.
  bool isStoredByVectors(AppendOp append) const;

protected:
  using LaneForms::LaneForms;
  void findOrder();

private:
  void findOrdered();
  /// Groups of these operations, of a block and of the conditions in it.
  void findGroups(mlir::Block &block,
                  const llvm::DenseSet<mlir::Operation *> &ops,
                  llvm::SmallVectorImpl<OrderedGroup> &found) const;
  /// The same of emissions, whose groups end where a condition begins.
  void findEmissionGroups(mlir::Block &block,
                          const llvm::DenseSet<mlir::Operation *> &ops,
                          llvm::SmallVectorImpl<OrderedGroup> &found) const;
  bool areEmissions(llvm::ArrayRef<mlir::Operation *> ops) const;
  /// Groups of operations that keep their order among one another.
  llvm::SmallVector<OrderedGroup>
  makeGroups(llvm::ArrayRef<mlir::Operation *> ops) const;
  /// Whether groups may run after all others.
  bool canDelay(llvm::ArrayRef<OrderedGroup> groups) const;
  bool canDelay(const OrderedGroup &group,
                const llvm::SetVector<mlir::Operation *> &rest) const;
  bool isMovable(mlir::Operation *op) const;
  bool addEmission(mlir::Operation *op, PortEmissions &port) const;
  void findEmissions();

  llvm::SmallVector<OrderedGroup> groups;
  llvm::SmallVector<PortEmissions> emissions;
  llvm::DenseSet<mlir::Operation *> emitted;
};

/// All of it, and what it takes.
class IterationLanes : public LaneOrder {
public:
  /// Of a loop whose iterations are independent but for barriers; with these it
  /// has at most as many iterations as there are lanes.
  IterationLanes(mlir::scf::ForOp loop, int64_t laneCount);

  /// Whether a side of a condition is short, and may be computed for nothing.
  bool isCheap(mlir::Region &region) const;
  /// Estimates for as many iterations as there are lanes, in cycles.
  struct Cost {
    double vectors = 0, serial = 0; ///< at once, and one after the other
    double slowVectors = 0, slowSerial = 0; ///< Of these, in slow paths.
    double lines = 0;      ///< Of `vectors`, what lanes take of the cache.
    bool computes = false; ///< Or iterations clear or copy.
    /// What costs most where lanes take turns, or are in other places.
    std::multimap<double, mlir::Operation *, std::greater<>> obstacles;
    /// Of `serial`, what inner loops take.
    llvm::DenseMap<mlir::Operation *, double> loops;
    bool isWorthwhile() const { return vectors < serial; }
    /// What to multiply `vectors` and `serial` by to have the geometric means
    /// of what it takes where slow paths mostly run, and where they never do.
    double weighVectors() const { return weigh(slowVectors, vectors); }
    double weighSerial() const { return weigh(slowSerial, serial); }
    static double weigh(double slow, double all) {
      return slow > 0 ? std::sqrt(std::max(0.0, 1 - slow / all)) : 1;
    }
  };
  Cost getCost() const;
  /// The same by other constants.
  Cost getCost(const Cycles &cycles) const;
  /// How many iterations each lane makes of a loop that lanes leave at
  /// different times, as far as is known.
  double getOwnIterations(mlir::Operation *inner) const;
  /// How many iterations all lanes together make of a loop that is made of
  /// these two, as far as is known.
  double getFlatIterations(mlir::Operation *outer,
                           mlir::Operation *inner) const;

private:
  void analyze();
  /// Whether there were any.
  bool splitArraysOfIterations();
  bool addInstructions(mlir::Region &region, bool isOfStrip,
                       int64_t &count) const;
};

/// How often a loop iterates each time, if that is known, but for sums that
/// wrap.
std::optional<int64_t> getConstantIterations(mlir::scf::ForOp loop);

/// Whether a side of a condition has the loops of the other one with tests that
/// may fail, for indices that are not all inside.
bool isFallback(mlir::Region &region);

/// Whether an operation is control flow, which predication replaces.
bool isStructure(mlir::Operation *op);

/// Whether it only asks for memory ahead of time: a vector's loads do so
/// themselves.
bool isPrefetch(mlir::Operation *op);

/// Whether a loop is there to ask for memory: not one over primitives, whose
/// lanes read it right away.
bool asksAhead(mlir::scf::ForOp loop);

/// Whether a loop iterates no more often than there are lanes, as one over a
/// strip.
bool isOneVector(mlir::scf::ForOp loop, int64_t laneCount);

/// The name of the array of pixels (`marks::pixels`) that a store changes, or
/// null.
mlir::Attribute getPixels(mlir::memref::StoreOp store);

/// Whether vectors have the operation: functions are exact, or the same for a
/// vector as for a number.
bool hasVectorForm(mlir::Operation *op);
/// Whether it may trap, or takes as long for one lane as for all.
bool isDivision(mlir::Operation *op);
/// Whether it is one of 32 bits for which floats of 64 bits are divided.
bool isDividedAsFloats(mlir::Operation *op);
/// Whether it may trap where its last operand is 0.
bool isIntegerDivision(mlir::Operation *op);

/// Whether lanes have values of this type: numbers, and primitives, of which
/// they have the addresses.
bool isLaneType(mlir::Type type);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_ITERATIONLANES_H
