// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What several places of a program compute alike, as a graph, and where it is
// cheapest to cut: what is before the cut stays in each place, what is after
// it moves elsewhere, once.

#ifndef PIKO_LIB_TRANSFORMS_COMMONSLICE_H
#define PIKO_LIB_TRANSFORMS_COMMONSLICE_H

#include "mlir/IR/Builders.h"
#include "mlir/IR/Operation.h"

#include <functional>
#include <map>

namespace piko {

/// The values that stand for each other, one of each place.
using Counterparts = llvm::SmallVector<mlir::Value, 2>;

/// The backward slice of some operations, of all places at once.
class CommonSlice {
public:
  struct Rules {
    /// Whether counterparts are known where the slice moves to.
    std::function<bool(const Counterparts &)> isKnown;
    /// Whether an operation, with what it holds, gives the same value there.
    std::function<bool(mlir::Operation *)> isMovable;
    /// Whether an operation is to move, whatever has to be kept for it.
    std::function<bool(mlir::Operation *)> mustMove;
  };
  explicit CommonSlice(Rules rules) : rules(std::move(rules)) {}

  /// Adds operations that do the same, one of each place, and are to move, with
  /// what they are computed from; false if they do not do the same.
  bool addRoot(llvm::ArrayRef<mlir::Operation *> ops);

  /// All operations of the first place.
  llvm::SmallVector<mlir::Operation *> getOperations() const;

  /// Finds the cut that keeps the fewest bytes, and of these the earliest;
  /// false if something can neither move nor be kept.
  bool cut();

  /// What has to be kept.
  llvm::ArrayRef<Counterparts> getKept() const { return kept; }
  /// The operations of the first place that move.
  llvm::SmallVector<mlir::Operation *> getMoved() const;

  /// Makes what has moved: `known` gives the values of counterparts that are
  /// known there, `keptValues` are those of `getKept()`.
  void rebuild(mlir::OpBuilder &builder,
               llvm::function_ref<mlir::Value(const Counterparts &)> known,
               llvm::ArrayRef<mlir::Value> keptValues) const;

private:
  /// Operations that do the same, one of each place.
  struct Instance {
    mlir::Operation *op; // of the first place
    /// The first place's values that it uses, also those from outside that its
    /// regions use, and the nodes that they belong to.
    llvm::SmallVector<std::pair<mlir::Value, int>, 4> uses;
  };
  /// A value of each place.
  struct Node {
    Counterparts values;
    bool isKnown = false;
    int instance = -1; // that computes it, or none that can move
  };

  int getNode(const Counterparts &values);
  int getInstance(llvm::ArrayRef<mlir::Operation *> ops);
  bool fill(Instance &instance, llvm::ArrayRef<mlir::Operation *> ops);
  bool isRoot(int instance) const;

  Rules rules;
  llvm::SmallVector<Node, 0> nodes;
  llvm::SmallVector<Instance, 0> instances; // those used before their users
  std::map<std::vector<void *>, int> nodeOf, instanceOf;
  llvm::SmallVector<int> roots;
  // Of the cut.
  llvm::SmallVector<bool> moves; // by instance
  llvm::SmallVector<Counterparts> kept;
  llvm::SmallVector<int> keptNodes;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_COMMONSLICE_H
