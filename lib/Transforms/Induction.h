// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What holds for the values that a loop carries.

#ifndef PIKO_LIB_TRANSFORMS_INDUCTION_H
#define PIKO_LIB_TRANSFORMS_INDUCTION_H

#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {

/// What an argument of a loop's body stands for in the condition's region, and
/// the condition that holds in the body.
inline std::pair<mlir::Value, mlir::Value>
getConditioned(mlir::BlockArgument argument) {
  auto loop =
      mlir::dyn_cast<mlir::scf::WhileOp>(argument.getOwner()->getParentOp());
  if (!loop || argument.getOwner() != loop.getAfterBody())
    return {};
  mlir::scf::ConditionOp condition = loop.getConditionOp();
  return {condition.getArgs()[argument.getArgNumber()],
          condition.getCondition()};
}

/// Whether something holds for an argument of the condition's region, by
/// induction over the turns of the loop. `holds` may take for granted what is
/// `assumed`.
inline bool holdsByInduction(mlir::BlockArgument argument,
                             llvm::SmallDenseSet<mlir::Value> &assumed,
                             llvm::function_ref<bool(mlir::Value)> holds) {
  auto loop =
      mlir::dyn_cast<mlir::scf::WhileOp>(argument.getOwner()->getParentOp());
  if (!loop)
    return false;
  unsigned i = argument.getArgNumber();
  if (!holds(loop.getInits()[i]))
    return false;
  assumed.insert(argument);
  bool steps = holds(loop.getYieldOp().getResults()[i]);
  assumed.erase(argument);
  return steps;
}

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_INDUCTION_H
