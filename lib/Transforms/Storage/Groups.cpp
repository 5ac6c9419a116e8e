// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Transforms/Storage/Groups.h"

#include "Piko/Transforms/Storage/PixelAccess.h"
#include "Piko/Transforms/Storage/Slots.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/IRMapping.h"

using namespace mlir;
using namespace piko;

/// A number for the key of a cell: cells with the same one are one group.
static Value createGroupNumber(OpBuilder &builder, Location loc,
                               ValueRange key) {
  Type i64 = builder.getI64Type();
  int64_t bits = 64 / std::max<size_t>(2, key.size());
  Value number;
  for (auto [dim, coordinate] : llvm::enumerate(key)) {
    Value part = arith::IndexCastOp::create(builder, loc, i64, coordinate);
    if (dim > 0)
      part = arith::ShLIOp::create(
          builder, loc, part,
          arith::ConstantIntOp::create(builder, loc, dim * bits, 64));
    number =
        number ? arith::OrIOp::create(builder, loc, number, part) : Value(part);
  }
  return number;
}

Value piko::createGroup(OpBuilder &builder, GroupedOp op, ValueRange key) {
  Location loc = op.getLoc();
  auto choice =
      scf::IfOp::create(builder, loc, builder.getI1Type(), op.getCondition(),
                        /*withElseRegion=*/true);
  OpBuilder then = choice.getThenBodyBuilder();
  CodeBuilder code(then, loc);
  Value isInside = code.boolean(true);
  op.walk([&](UpdateOp update) {
    auto test = createInsideTest(then, update, key, then.getI1Type());
    scf::YieldOp::create(then, loc, code.boolean(true));
    then.setInsertionPointAfter(test);
    isInside = code.both(isInside, test.getResult(0));
    update->setAttr(marks::inside, builder.getUnitAttr());
  });
  scf::YieldOp::create(then, loc, isInside);
  OpBuilder otherwise = choice.getElseBodyBuilder();
  scf::YieldOp::create(otherwise, loc,
                       CodeBuilder(otherwise, loc).boolean(false));
  Value none = arith::ConstantIntOp::create(builder, loc, -1, 64);
  return arith::SelectOp::create(builder, loc, choice.getResult(0),
                                 createGroupNumber(builder, loc, key), none);
}

/// The iterations of a group, one after the other; the first is that of rank
/// `first`.
static void runGroup(CodeBuilder &b, GroupedOp op, Value first, Value count,
                     Value groups, Value ranks, ValueRange values,
                     ValueRange results) {
  OpBuilder &builder = b.builder;
  Value zero = b.index(0), one = b.index(1);
  using P = CodeBuilder::P;
  auto groupAt = [&](Value rank) {
    return b.load(groups, b.load(ranks, rank));
  };
  Value group = groupAt(first), isFirst = b.compare(P::eq, first, zero);
  Value before = b.select(isFirst, zero, b.sub(first, one));
  Value begins = b.either(isFirst, b.compare(P::ne, groupAt(before), group));
  Value none = arith::ConstantIntOp::create(builder, b.loc, -1, 64);
  b.when(b.both(begins, b.compare(P::ne, group, none)), [&] {
    scf::WhileOp::create(
        builder, b.loc, TypeRange{first.getType()}, first,
        [&](OpBuilder &, Location, ValueRange now) {
          Value iteration = b.load(ranks, now[0]);
          IRMapping mapping;
          for (auto [argument, array] :
               llvm::zip(op.getBody().getArguments(), values))
            mapping.map(argument,
                        Slots::load(builder, b.loc, argument.getType(), array,
                                    iteration));
          Block &body = op.getBody().front();
          for (Operation &inner : body.without_terminator())
            builder.clone(inner, mapping);
          for (auto [result, array] : llvm::zip(
                   cast<YieldOp>(body.getTerminator()).getResults(), results))
            Slots::store(builder, b.loc, mapping.lookupOrDefault(result), array,
                         iteration);
          Value next = b.add(now[0], one), last = b.sub(count, one);
          Value isSame = b.compare(P::eq, groupAt(b.min(next, last)), group);
          Value goesOn = b.both(b.compare(P::sle, next, last), isSame);
          scf::ConditionOp::create(builder, b.loc, goesOn, next);
        },
        [&](OpBuilder &, Location, ValueRange now) {
          scf::YieldOp::create(builder, b.loc, now);
        });
  });
}

scf::ForOp piko::createGroupLoop(OpBuilder &builder, GroupedOp op, Value count,
                                 Value groups, Value ranks, ValueRange values,
                                 ValueRange results) {
  CodeBuilder code(builder, op.getLoc());
  scf::ForOp loop =
      code.forEach(code.index(0), count, code.index(1), [&](Value rank) {
        runGroup(code, op, rank, count, groups, ranks, values, results);
      });
  loop->setAttr(marks::lanes, builder.getUnitAttr());
  loop->setAttr(marks::disjoint, builder.getUnitAttr());
  return loop;
}
