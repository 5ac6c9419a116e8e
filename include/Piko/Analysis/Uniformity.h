// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the values of a kernel's work are the same.

#ifndef PIKO_ANALYSIS_UNIFORMITY_H
#define PIKO_ANALYSIS_UNIFORMITY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// How far a value is the same, from the widest to the narrowest. An item is a
/// primitive, or one list.
enum class Uniform { Bin, Item, Iteration };

bool isBarrier(mlir::Operation *op);

/// Which of two values that a condition hands on stands for both, since the
/// other is poison; null if none does.
mlir::Value findOnlyValue(mlir::Value yes, mlir::Value no);

/// The first place inside an operation where the iterations of the enclosing
/// loop meet; null if they do not.
mlir::Operation *findBarrier(mlir::Operation *op);

/// What a text calls the first of those that it has itself.
llvm::StringRef getBarrierName(mlir::Operation *op);

/// How far the values inside an operation are the same. What the analysis does
/// not know is `Uniform::Iteration`, which promises nothing. All iterations are
/// taken to agree on the control flow around barriers: where they may not, the
/// loop that is made of it compares them.
///
/// The level of a private array, `memref.alloca` inside, is that of what is in
/// it. One that is filled outside is the same for all.
class Uniformity {
public:
  /// Where a value begins to differ.
  using Root = std::pair<mlir::Value, Uniform>;

  /// Of the values in `root`, which is a `piko.bins`, a `piko.items`, a
  /// `piko.lists`, or a loop over primitives or iterations with its induction
  /// variable among `roots`. Work and parallel loops inside are roots by
  /// themselves.
  /// In lockstep, a place that a loop hands on is the same for those that are
  /// still in it, where they began with the same; and a condition hands on what
  /// one of its sides does, if the other's is poison.
  explicit Uniformity(mlir::Operation *root, llvm::ArrayRef<Root> roots = {},
                      bool isLockstep = false);

  Uniform get(mlir::Value value) const { return levels.lookup(value); }
  /// Whether a value is the same for all items of the bin.
  bool isSameForBin(mlir::Value value) const {
    return get(value) == Uniform::Bin;
  }
  /// Whether a value may differ between the iterations of a parallel loop.
  bool isVarying(mlir::Value value) const {
    return get(value) == Uniform::Iteration;
  }
  /// The first operation around `op`, and inside of `region`, on which way to
  /// go iterations may not agree; null if there is none.
  mlir::Operation *findParting(mlir::Operation *op, mlir::Region &region) const;
  /// A value that takes the place of another.
  void replace(mlir::Value from, mlir::Value to) { mark(to, get(from)); }

private:
  /// Narrows what an operation defines; returns whether anything is new.
  bool visit(mlir::Operation *op);
  bool visitControlFlow(mlir::Operation *op);
  bool visitArrayAccess(mlir::Operation *op);
  bool isInside(mlir::Value array) const;
  bool isFinished(mlir::Value array) const;
  /// The level of what decides which way control flow goes.
  Uniform getDeciding(mlir::Operation *op) const;
  /// The same, where barriers are: there iterations agree.
  Uniform getParting(mlir::Operation *op) const;
  bool markArguments(mlir::Block &block, Uniform level);
  bool mark(mlir::Value value, Uniform level);
  Uniform get(mlir::ValueRange values) const;
  /// Narrows each of `targets` to its source, and to `least`.
  bool flow(mlir::ValueRange sources, mlir::ValueRange targets, Uniform least);
  /// The same of what a loop hands on, which in lockstep stays as wide as its
  /// sources if memory is accessed there: elsewhere lanes have it at hand.
  bool flowInside(mlir::ValueRange sources, mlir::ValueRange targets,
                  Uniform parts);
  bool visitIf(mlir::scf::IfOp choice, Uniform parts);
  void findMeetings();

  bool isLockstep;

  mlir::Operation *root;
  llvm::DenseMap<mlir::Value, Uniform> levels; ///< What is not in it: Bin.
  llvm::DenseSet<mlir::Attribute> written; ///< State that the kernel writes.
  /// Operations that findBarrier finds a barrier in.
  llvm::DenseSet<mlir::Operation *> meetings;
};

} // namespace piko

#endif // PIKO_ANALYSIS_UNIFORMITY_H
