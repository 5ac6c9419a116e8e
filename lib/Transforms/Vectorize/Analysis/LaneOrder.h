// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What lanes do one after the other, or emit together.

#ifndef PIKO_LIB_TRANSFORMS_LANEORDER_H
#define PIKO_LIB_TRANSFORMS_LANEORDER_H

#include "Vectorize/Analysis/LaneForms.h"

#include "llvm/ADT/SetVector.h"

namespace piko {

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

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANEORDER_H
