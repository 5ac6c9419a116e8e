// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "PikoToGPU/Blocks/LoopNest.h"

#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

std::optional<NestLoop> piko::findNestLoop(Operation *op) {
  using Predicate = arith::CmpIPredicate;
  auto loop = dyn_cast<scf::WhileOp>(op);
  std::optional<CountedLoop> counted =
      loop ? findCountedLoop(op) : std::nullopt;
  const CountedLoop::Bound *bound = counted ? counted->getBound() : nullptr;
  if (!bound || !counted->isByOne() || !counted->onlyCompares() ||
      loop.getNumResults() != 1 ||
      !llvm::is_contained(
          {Predicate::slt, Predicate::sle, Predicate::ult, Predicate::ule},
          bound->predicate))
    return std::nullopt;
  return NestLoop{loop, counted->first, bound->end, bound->predicate};
}

std::optional<NestLoop> piko::matchInnerLoop(NestLoop outer) {
  std::optional<NestLoop> inner;
  for (Operation &op : outer.body()->without_terminator()) {
    if (!op.getNumRegions() && isMemoryEffectFree(&op))
      continue;
    if (inner || !op.use_empty())
      return std::nullopt;
    inner = findNestLoop(&op);
    if (!inner)
      return std::nullopt;
  }
  if (!inner || !outer.loop.isDefinedOutsideOfLoop(inner->first) ||
      !outer.loop.isDefinedOutsideOfLoop(inner->bound))
    return std::nullopt;
  return inner;
}

void piko::coalesceLoops(Operation *op) {
  std::optional<NestLoop> outer = findNestLoop(op);
  std::optional<NestLoop> inner = outer ? matchInnerLoop(*outer) : std::nullopt;
  if (!inner || !op->use_empty())
    return;
  OpBuilder builder(op);
  Location loc = op->getLoc();
  auto goesOn = [](OpBuilder &at, Location where, const NestLoop &counted,
                   Value number) -> Value {
    return arith::CmpIOp::create(at, where, counted.predicate, number,
                                 counted.bound);
  };
  auto any = scf::IfOp::create(builder, loc,
                               goesOn(builder, loc, *inner, inner->first));
  builder.setInsertionPointToStart(any.thenBlock());
  scf::WhileOp::create(
      builder, loc, TypeRange{outer->first.getType(), inner->first.getType()},
      ValueRange{outer->first, inner->first},
      [&](OpBuilder &at, Location where, ValueRange now) {
        scf::ConditionOp::create(at, where, goesOn(at, where, *outer, now[0]),
                                 now);
      },
      [&](OpBuilder &at, Location where, ValueRange now) {
        IRMapping mapping;
        mapping.map(outer->body()->getArgument(0), now[0]);
        mapping.map(inner->body()->getArgument(0), now[1]);
        for (Operation &each : outer->body()->without_terminator()) {
          if (&each != inner->loop) {
            at.clone(each, mapping);
            continue;
          }
          for (Operation &work : inner->body()->without_terminator())
            at.clone(work, mapping);
        }
        Value row = mapping.lookup(outer->loop.getYieldOp().getOperand(0)),
              next = mapping.lookup(inner->loop.getYieldOp().getOperand(0));
        Value isSame = goesOn(at, where, *inner, next);
        row = arith::SelectOp::create(at, where, isSame, now[0], row);
        next = arith::SelectOp::create(at, where, isSame, next, inner->first);
        scf::YieldOp::create(at, where, ValueRange{row, next});
      });
  op->erase();
}
