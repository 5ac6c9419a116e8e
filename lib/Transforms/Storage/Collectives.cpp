// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The order of combination is the reference's (piko/reference/collectives.h).

#include "Piko/Transforms/Storage/Collectives.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/IRMapping.h"
#include "mlir/IR/TypeUtilities.h"

using namespace mlir;
using namespace piko;

namespace {

struct Writer : CodeBuilder {
  using CodeBuilder::CodeBuilder;

  /// for (s = 1; s < count; s *= 2) state = body(s, state); the last state.
  SmallVector<Value>
  forEachPower(Value count, ValueRange state,
               llvm::function_ref<SmallVector<Value>(Value, ValueRange)> body) {
    SmallVector<Value> inits{index(1)};
    llvm::append_range(inits, state);
    auto loop = scf::WhileOp::create(
        builder, loc, ValueRange(inits).getTypes(), inits,
        [&](OpBuilder &, Location, ValueRange arguments) {
          scf::ConditionOp::create(builder, loc,
                                   compare(P::slt, arguments.front(), count),
                                   arguments);
        },
        [&](OpBuilder &, Location, ValueRange arguments) {
          Value s = arguments.front();
          SmallVector<Value> next = body(s, arguments.drop_front());
          next.insert(next.begin(), add(s, s));
          scf::YieldOp::create(builder, loc, next);
        });
    return SmallVector<Value>(loop.getResults().drop_front());
  }

  /// Conditions as the bytes that slots hold, or as they are.
  SmallVector<Value> combine(Block &body, ValueRange left, ValueRange right) {
    IRMapping mapping;
    SmallVector<Value> pair(left);
    llvm::append_range(pair, right);
    for (auto [argument, value] : llvm::zip(body.getArguments(), pair)) {
      bool isByte = value.getType() != argument.getType();
      mapping.map(argument,
                  isByte ? arith::TruncIOp::create(builder, loc,
                                                   argument.getType(), value)
                               .getResult()
                         : value);
    }
    for (Operation &op : body.without_terminator())
      builder.clone(op, mapping);
    SmallVector<Value> results;
    for (auto [result, value] :
         llvm::zip(cast<YieldOp>(body.getTerminator()).getResults(), left)) {
      Value combined = mapping.lookupOrDefault(result);
      if (combined.getType() != value.getType())
        combined =
            arith::ExtUIOp::create(builder, loc, value.getType(), combined);
      results.push_back(combined);
    }
    return results;
  }

  /// Whether a < b; NaNs are equal to each other and greater than all else.
  Value isLess(Value a, Value b, bool isUnsigned) {
    Type type = getElementTypeOrSelf(a.getType());
    if (!isa<FloatType>(type))
      return compare(isUnsigned || type.isInteger(1) ? P::ult : P::slt, a, b);
    Value isNumber = compare(arith::CmpFPredicate::ORD, a, a);
    Value isNaN = compare(arith::CmpFPredicate::UNO, b, b);
    return either(compare(arith::CmpFPredicate::OLT, a, b),
                  both(isNumber, isNaN));
  }
};

} // namespace

SmallVector<Value> piko::createCombination(OpBuilder &builder, Location loc,
                                           Block &combine, ValueRange left,
                                           ValueRange right) {
  return Writer(builder, loc).combine(combine, left, right);
}

Value piko::createLess(OpBuilder &builder, Location loc, Value a, Value b,
                       bool isUnsigned) {
  return Writer(builder, loc).isLess(a, b, isUnsigned);
}

/// At distance s = 1, 2, 4, ..., for each multiple i of 2s with i + s < count.
static void forEachPair(Writer &w, Value count,
                        llvm::function_ref<void(Value i, Value j)> body) {
  w.forEachPower(count, {}, [&](Value s, ValueRange) {
    w.forEach(w.index(0), w.sub(count, s), w.add(s, s),
              [&](Value i) { body(i, w.add(i, s)); });
    return SmallVector<Value>();
  });
}

void piko::createReduction(OpBuilder &builder, Location loc, Value count,
                           ValueRange slots, Block &combine) {
  Writer w(builder, loc);
  forEachPair(w, count, [&](Value i, Value j) {
    w.store(w.combine(combine, w.load(slots, i), w.load(slots, j)), slots, i);
  });
}

// The blocks that make up [0, j) end with the one of j's lowest bit s, which is
// [j - s, j). It is in slot j - s just before the pair (j - s, j) is combined;
// slot j is not read after that, so the block can wait there.
void piko::createScan(OpBuilder &builder, Location loc, Value count,
                      ValueRange slots, Block &combine) {
  Writer w(builder, loc);
  forEachPair(w, count, [&](Value i, Value j) {
    SmallVector<Value> left = w.load(slots, i), right = w.load(slots, j);
    w.store(w.combine(combine, left, right), slots, i);
    w.store(left, slots, j);
  });
  // Then [0, j) is [0, j - s) and the block.
  Value zero = w.index(0), one = w.index(1);
  w.forEach(one, count, one, [&](Value j) {
    Value s = w.both(j, w.sub(zero, j));
    Value several = w.compare(Writer::P::ne, j, s);
    w.when(several, [&] {
      w.store(w.combine(combine, w.load(slots, w.sub(j, s)), w.load(slots, j)),
              slots, j);
    });
  });
}

/// Merges the sorted runs [lo, mid) and [mid, hi) of numbers of keys.
static void mergeRuns(Writer &w, Value keys, bool isUnsigned, Value room,
                      Value from, Value to, Value lo, Value mid, Value hi) {
  OpBuilder &builder = w.builder;
  Location loc = w.loc;
  Value one = w.index(1);
  auto loop =
      scf::ForOp::create(builder, loc, lo, hi, one, ValueRange{lo, mid});
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(loop.getBody());
  Value left = loop.getRegionIterArg(0), right = loop.getRegionIterArg(1);
  // Beyond its end a run is read at its last element, for nothing.
  auto head = [&](Value at, Value end) {
    return w.load(room, w.add(from, w.min(at, w.sub(end, one))));
  };
  Value a = head(left, mid), b = head(right, hi);
  Value leftEnded = w.compare(Writer::P::sge, left, mid);
  Value rightLasts = w.compare(Writer::P::slt, right, hi);
  Value less = w.isLess(w.load(keys, b), w.load(keys, a), isUnsigned);
  Value takeRight = w.either(leftEnded, w.both(rightLasts, less));
  w.store(w.select(takeRight, b, a), room, w.add(to, loop.getInductionVar()));
  scf::YieldOp::create(
      builder, loc,
      ValueRange{w.select(takeRight, left, w.add(left, one)),
                 w.select(takeRight, w.add(right, one), right)});
}

// A stable merge sort from the bottom up, between the halves of `room`.
void piko::createSort(OpBuilder &builder, Location loc, Value count, Value keys,
                      bool isUnsigned, Value room, Value ranks) {
  Writer w(builder, loc);
  Value zero = w.index(0), one = w.index(1);
  w.forEach(zero, count, one, [&](Value i) { w.store(i, room, i); });
  SmallVector<Value> halves =
      w.forEachPower(count, {zero, count}, [&](Value width, ValueRange halves) {
        w.forEach(zero, count, w.add(width, width), [&](Value lo) {
          Value mid = w.min(w.add(lo, width), count);
          Value hi = w.min(w.add(mid, width), count);
          mergeRuns(w, keys, isUnsigned, room, halves[0], halves[1], lo, mid,
                    hi);
        });
        return SmallVector<Value>{halves[1], halves[0]};
      });
  w.forEach(zero, count, one, [&](Value i) {
    w.store(w.load(room, w.add(halves[0], i)), ranks, i);
  });
}

//===----------------------------------------------------------------------===//
// With loops that lanes share
//===----------------------------------------------------------------------===//

static void forEachShared(Writer &w, Value from, Value to,
                          llvm::function_ref<void(Value)> body) {
  scf::ForOp loop = w.forEach(from, to, w.index(1), body);
  loop->setAttr(marks::lanes, w.builder.getUnitAttr());
}

/// The pairs (i, i + s) of a distance s below `count`, from the k-th on.
static void forEachSharedPair(Writer &w, Value count, Value s, int64_t first,
                              llvm::function_ref<void(Value i, Value j)> body) {
  Value both = w.add(s, s);
  Value pairs =
      arith::CeilDivUIOp::create(w.builder, w.loc, w.sub(count, s), both);
  forEachShared(w, w.index(first), pairs, [&](Value k) {
    Value i = w.mul(k, both);
    body(i, w.add(i, s));
  });
}

void piko::createSharedReduction(OpBuilder &builder, Location loc, Value count,
                                 ValueRange slots, Block &combine) {
  Writer w(builder, loc);
  w.forEachPower(count, {}, [&](Value s, ValueRange) {
    forEachSharedPair(w, count, s, 0, [&](Value i, Value j) {
      w.store(w.combine(combine, w.load(slots, i), w.load(slots, j)), slots, i);
    });
    return SmallVector<Value>();
  });
}

// What stands before a slot is known once it is for all numbers of which more
// low bits are zero; so distances fall again.
void piko::createSharedScan(OpBuilder &builder, Location loc, Value count,
                            ValueRange slots, Block &combine) {
  Writer w(builder, loc);
  Value zero = w.index(0), one = w.index(1);
  Value last = w.forEachPower(count, zero, [&](Value s, ValueRange) {
    forEachSharedPair(w, count, s, 0, [&](Value i, Value j) {
      SmallVector<Value> left = w.load(slots, i), right = w.load(slots, j);
      w.store(w.combine(combine, left, right), slots, i);
      w.store(left, slots, j);
    });
    return SmallVector<Value>{s};
  })[0];
  scf::WhileOp::create(
      builder, loc, TypeRange{last.getType()}, ValueRange{last},
      [&](OpBuilder &, Location, ValueRange now) {
        Value more = w.compare(Writer::P::sgt, now[0], zero);
        scf::ConditionOp::create(builder, loc, more, now);
      },
      [&](OpBuilder &, Location, ValueRange now) {
        Value s = now[0];
        forEachSharedPair(w, count, s, 1, [&](Value i, Value j) {
          w.store(w.combine(combine, w.load(slots, i), w.load(slots, j)), slots,
                  j);
        });
        Value next = arith::ShRUIOp::create(builder, loc, s, one);
        scf::YieldOp::create(builder, loc, next);
      });
}

/// How many elements of the sorted run [lo, hi) come before a key, or before it
/// and its equals, which `isRight` says: by bisection.
static Value countBefore(Writer &w, Value keys, bool isUnsigned, Value room,
                         Value from, Value lo, Value hi, Value key,
                         Value isRight) {
  OpBuilder &builder = w.builder;
  Location loc = w.loc;
  auto loop = scf::WhileOp::create(
      builder, loc, TypeRange{lo.getType(), lo.getType()}, ValueRange{lo, hi},
      [&](OpBuilder &, Location, ValueRange now) {
        Value more = w.compare(Writer::P::slt, now[0], now[1]);
        scf::ConditionOp::create(builder, loc, more, now);
      },
      [&](OpBuilder &, Location, ValueRange now) {
        Value sum = w.add(now[0], now[1]), one = w.index(1);
        Value middle = arith::ShRUIOp::create(builder, loc, sum, one);
        Value other = w.load(keys, w.load(room, w.add(from, middle)));
        Value isBefore = w.isLess(other, key, isUnsigned);
        Value isAfter = w.isLess(key, other, isUnsigned);
        Value notAfter = w.compare(Writer::P::eq, isAfter, w.boolean(false));
        Value isIn = w.select(isRight, notAfter, isBefore);
        scf::YieldOp::create(
            builder, loc,
            ValueRange{w.select(isIn, w.add(middle, one), now[0]),
                       w.select(isIn, now[1], middle)});
      });
  return w.sub(loop.getResult(0), lo);
}

// A stable merge sort in which each element finds its place in the merged run:
// as many as stand before it in its own, and as come before it in the other.
void piko::createSharedSort(OpBuilder &builder, Location loc, Value count,
                            Value keys, bool isUnsigned, Value room,
                            Value ranks) {
  Writer w(builder, loc);
  Value zero = w.index(0);
  forEachShared(w, zero, count, [&](Value i) { w.store(i, room, i); });
  SmallVector<Value> halves =
      w.forEachPower(count, {zero, count}, [&](Value width, ValueRange halves) {
        Value from = halves[0], to = halves[1];
        Value low = w.sub(zero, w.add(width, width));
        forEachShared(w, zero, count, [&](Value i) {
          Value element = w.load(room, w.add(from, i));
          Value lo = w.both(i, low), mid = w.min(w.add(lo, width), count);
          Value hi = w.min(w.add(mid, width), count);
          Value isRight = w.compare(Writer::P::sge, i, mid);
          Value others = w.select(isRight, lo, mid);
          Value end = w.select(isRight, mid, hi);
          Value before = countBefore(w, keys, isUnsigned, room, from, others,
                                     end, w.load(keys, element), isRight);
          Value own = w.sub(i, w.select(isRight, mid, lo));
          Value place = w.add(w.add(lo, own), before);
          w.store(element, room, w.add(to, place));
        });
        return SmallVector<Value>{to, from};
      });
  forEachShared(w, zero, count, [&](Value i) {
    w.store(w.load(room, w.add(halves[0], i)), ranks, i);
  });
}
