//===- LinearFacts.h - What is known of integers at a place -----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Values of a phase as linear expressions over what cannot be taken apart, and
// all that holds of them at one place: bounds of loops, conditions passed on
// the way, minima and maxima, quotients and remainders, floats that are whole
// numbers, and the bin.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_ANALYSIS_LINEARFACTS_H
#define PIKO_ANALYSIS_LINEARFACTS_H

#include "Piko/Analysis/LinearSystem.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/DenseMap.h"

#include <functional>
#include <map>

namespace piko {

class ContractOp;

/// The most cells that a domain may have in a dimension: PIKORT_MAX_EXTENT.
inline constexpr int64_t maxDomainExtent = int64_t(1) << 30;

/// How an argument of a loop changes from iteration to iteration.
struct Recurrence {
  /// What each iteration adds, if that is always the same.
  std::optional<int64_t> step;
  bool rises = false, falls = false; ///< if not, it may do either
  /// What stands still while the loop runs, and is never passed.
  mlir::Value ceiling, floor;
};

/// What facts about one place may ask about others.
class FactsProvider {
public:
  virtual ~FactsProvider() = default;
  /// Whether a field of a stage's primitives is, in one dimension, a coordinate
  /// between the bounds of the bin that is processed.
  virtual bool isFieldInBin(StageOp, llvm::StringRef /*field*/,
                            int64_t /*dim*/) {
    return false;
  }
  /// Recurrences by argument, found once.
  llvm::DenseMap<mlir::Value, Recurrence> recurrences;
};

class LinearFacts;

/// Of LinearFacts: domains, extents, and the bin that is processed.
class BinFacts {
public:
  explicit BinFacts(LinearFacts &core) : core(core) {}

  Linear getDomain(int64_t dim);
  Linear getExtent(llvm::StringRef state, int64_t dim);
  /// How many elements may be read: one, too, of a buffer that contracts are
  /// about and that has none.
  Linear getRoom(llvm::StringRef state, int64_t dim);
  /// Adds what contracts say of a number that is read, or comes from some, or
  /// of what it is when widened without a sign.
  void assumeContract(mlir::Value value, unsigned frame, const Linear &number,
                      bool isWidened);
  Linear getListSize(mlir::Value list);
  std::pair<Linear, Linear> getBin(int64_t dim);
  bool isAboveBin(mlir::Value coordinate, int64_t dim, unsigned frame);
  bool isBelowBin(mlir::Value coordinate, int64_t dim, unsigned frame);
  bool isOwnBin(mlir::Value bin, unsigned frame);
  /// Whether a value is a primitive of the bin that is processed.
  bool isItem(mlir::Value prim, unsigned frame);
  void findItems();
  /// Adds that the bin that is processed is one that the stage's own assign
  /// phase chose for a primitive.
  void assumeAssigned(mlir::Value item);
  LinearFact describeInBin(BinAtOp cell, unsigned frame);

private:
  /// Whether a value is a primitive that has reached the stage.
  bool isFed(mlir::Value prim, unsigned frame);
  void assumeBelow(ContractOp contract, mlir::Type type, const Linear &number,
                   bool isWidened);
  /// Whether a list is read at an index that it has.
  bool isInside(ListAtOp read);
  /// Whether no call gets an empty list.
  bool isNeverEmpty(mlir::Value list);
  Linear addSize();
  /// That the bin that is processed has cells of a closed box.
  LinearFact describeTouched(AssignBoxOp box, unsigned frame);

  LinearFacts &core;
  std::map<int64_t, Linear> domains;
  std::map<int64_t, std::pair<Linear, Linear>> bins;
  std::map<std::pair<std::string, int64_t>, Linear> extents;
  std::map<std::string, Linear> rooms; ///< Of buffers that contracts index.
};

/// Of LinearFacts: floats that are whole numbers, or whose floor is known.
class FloatFacts {
public:
  explicit FloatFacts(LinearFacts &core) : core(core) {}

  Linear expandFloatCast(mlir::Operation *op, unsigned frame, unsigned id);
  /// The floor of a coordinate; adds to `unknown` what must be 0 for it.
  Linear getCell(mlir::Value coordinate, unsigned frame,
                 std::optional<Linear> &unknown);
  LinearFact describeFloat(mlir::arith::CmpFOp compare, bool truth,
                           unsigned frame);
  /// What a comparison of exact floats surely gives, found out on the way.
  std::optional<bool> decide(mlir::Value condition, unsigned frame);

private:
  /// A float that is a multiple of 2^-shift.
  struct Exact {
    Linear scaled;
    int shift;
  };
  /// A float of which only the floor is known, and whether it is NaN.
  struct Opaque {
    Linear floor, isNaN;
    bool isWhole;
  };
  using Id = unsigned;
  std::optional<Exact> getExact(Id id);
  std::optional<Exact> findExact(Id id);
  Opaque getOpaque(Id id);
  std::optional<Exact> fitExact(Exact number, mlir::Type type);

  LinearFacts &core;
  std::map<Id, std::optional<Exact>> exacts;
  std::map<Id, Opaque> opaques;
};

/// Of LinearFacts: what a condition says.
class ConditionFacts {
public:
  explicit ConditionFacts(LinearFacts &core) : core(core) {}

  LinearFact describe(mlir::Value condition, bool truth, unsigned frame);
  LinearFact describeUnknown(mlir::Value condition, bool truth, unsigned frame);

private:
  LinearFact describeInteger(mlir::arith::CmpIOp compare, bool truth,
                             unsigned frame);
  /// What a truth value says that is one of two, of which null is unknown.
  LinearFact describeChoice(mlir::Value condition, mlir::Value ifTrue,
                            mlir::Value ifFalse, bool truth, unsigned frame);
  /// What one says that control flow gives.
  std::optional<LinearFact> describeFlow(mlir::Value condition, bool truth,
                                         unsigned frame);
  /// That two truth values are equal, or not.
  LinearFact describeEqual(mlir::Value a, mlir::Value b, bool isEqual,
                           unsigned frame);
  /// Whether a comparison for equality is that of a cell's bin with the bin
  /// that is processed; the cell's coordinates.
  BinAtOp getComparedCell(mlir::arith::CmpIOp compare, unsigned frame);

  LinearFacts &core;
  /// Of conditions that say nothing else.
  llvm::DenseMap<unsigned, Linear> truths;
};

/// What is known at a place of a phase.
class LinearFacts {
public:
  /// `assume` adds what is known besides, before anything is found out.
  LinearFacts(mlir::Operation *at, FactsProvider &provider,
              llvm::function_ref<void(LinearFacts &)> assume = nullptr);

  /// An assign phase seen from the process phase: its primitive is one that is
  /// emitted, or one that is processed. The number of such a phase is passed
  /// with its values.
  unsigned addAssign(AssignOp assign, EmissionOpInterface emit);
  unsigned addAssign(AssignOp assign, mlir::Value item);
  /// The primitives that the place has been given: the one that is processed,
  /// or those of the list that have been read at indices known to be inside.
  llvm::ArrayRef<mlir::Value> getItems() const { return items; }
  /// Adds what holds where `at` is reached.
  void assumeReached(mlir::Operation *at, unsigned frame = 0);
  /// Adds that a condition is true, or false.
  void assume(mlir::Value condition, bool truth, unsigned frame = 0);
  /// Adds that one value is at most another.
  void assumeAtMost(mlir::Value low, mlir::Value high) {
    facts->addAtLeastZero(get(high) - get(low));
  }

  Linear get(mlir::Value value, unsigned frame = 0);
  /// Whether two values are computed alike, from what is the same.
  bool isSame(mlir::Value a, unsigned frameOfA, mlir::Value b,
              unsigned frameOfB) {
    return number(a, frameOfA) == number(b, frameOfB);
  }
  Linear getRoom(llvm::StringRef state, int64_t dim) {
    return bin.getRoom(state, dim);
  }
  Linear getListSize(mlir::Value list) { return bin.getListSize(list); }
  bool isAtLeastZero(const Linear &value) {
    return system.isAtLeastZero(value, /*effort=*/40);
  }
  /// Whether a coordinate, an integer or a float, is not below the bin that is
  /// processed, or not above it.
  bool isAboveBin(mlir::Value coordinate, int64_t dim, unsigned frame = 0) {
    return bin.isAboveBin(coordinate, dim, frame);
  }
  bool isBelowBin(mlir::Value coordinate, int64_t dim, unsigned frame = 0) {
    return bin.isBelowBin(coordinate, dim, frame);
  }
  /// The bounds of the bin that is processed, half open.
  std::pair<Linear, Linear> getBin(int64_t dim) { return bin.getBin(dim); }

private:
  // They need one another: what a condition says is of values, which
  // conditions choose.
  friend class BinFacts;
  friend class FloatFacts;
  friend class ConditionFacts;
  struct Scope {
    mlir::Value primitive;    ///< null for the phase of the place itself
    mlir::Value same;         ///< the primitive that it is there
    EmissionOpInterface emit; ///< or the emission of it
  };
  using Id = unsigned;

  // Numbers of values that are computed alike.
  Id number(mlir::Value value, unsigned frame);
  Id create(mlir::Value value, unsigned frame);
  mlir::Value valueOf(Id id) const { return values[id].first; }

  // Values as expressions.
  Linear expand(Id id);
  Linear expandArgument(mlir::BlockArgument argument, unsigned frame, Id id);
  Linear expandCarried(mlir::BlockArgument argument, mlir::Value init,
                       unsigned frame, Id id);
  Linear expandOperation(mlir::Operation *op, unsigned frame, Id id);
  Linear expandArithmetic(mlir::Operation *op, unsigned frame, Id id);
  Linear expandProduct(mlir::Operation *op, unsigned frame, Id id);
  Linear expandMask(mlir::Operation *op, unsigned frame, Id id);
  Linear expandShift(mlir::Operation *op, unsigned frame, Id id);
  Linear expandQuotient(mlir::Value of, mlir::Value by, bool isSigned,
                        bool isRemainder, unsigned frame, Id id);
  Linear expandExtremum(mlir::Operation *op, unsigned frame, Id id);
  Linear expandBranch(mlir::scf::IfOp choice, unsigned result, unsigned frame,
                      Id id);
  Linear expandSelect(mlir::arith::SelectOp select, unsigned frame, Id id);
  /// One of two values, of which null is unknown. What holds of one holds only
  /// where it is chosen.
  Linear chooseBetween(mlir::Value condition, mlir::Value ifTrue,
                       mlir::Value ifFalse, unsigned frame, Id id);
  /// Expands what a value that an arm of a branch gives is computed from before
  /// the branch: what holds of that holds whichever arm runs.
  void expandAhead(mlir::scf::IfOp branch, mlir::Value value, unsigned frame);
  Linear expandField(GetOp get, unsigned frame, Id id);
  /// Whether a value is at least 0, found out on the way to something else.
  bool isSurelyAtLeastZero(const Linear &value) {
    return system.isAtLeastZero(value, /*effort=*/10);
  }
  /// A variable for the value of an operation, in the range of its type.
  Linear atom(mlir::Type type);
  Linear atom(Id id) { return atom(valueOf(id).getType()); }
  /// The value, if it fits in the type; else a variable.
  Linear fit(const Linear &value, Id id);
  bool fits(const Linear &value, mlir::Type type);
  /// The floor of a value divided by a positive number.
  Linear divide(const Linear &value, const llvm::DynamicAPInt &by);
  /// What a quotient by `by` is below, if the dividend is below a product.
  std::optional<Linear> findOtherFactor(const Linear &of, const Linear &by);

  const Recurrence &getRecurrence(mlir::BlockArgument argument);

  mlir::Operation *at;
  FactsProvider &provider;
  StageOp stage;
  PipelineOp pipeline;
  LinearSystem system;
  /// Where facts go: all hold, or those of an arm that is looked at.
  LinearFact *facts;
  llvm::SmallVector<Scope> frames{1};
  llvm::SmallVector<mlir::Value> items;
  llvm::SmallVector<std::pair<mlir::Value, unsigned>> values; // by id
  llvm::DenseMap<std::pair<mlir::Value, unsigned>, Id> ids;
  std::map<std::vector<uintptr_t>, Id> idsByKey;
  llvm::DenseMap<Id, Linear> expressions;
  /// Products of values that are not negative, with their factors.
  std::vector<std::array<Linear, 3>> products;
  BinFacts bin{*this};
  FloatFacts floats{*this};
  ConditionFacts conditions{*this};
};

/// How an argument of an `scf.while`'s first block changes.
Recurrence findRecurrence(mlir::BlockArgument argument,
                          FactsProvider &provider);

} // namespace piko

#endif // PIKO_ANALYSIS_LINEARFACTS_H
