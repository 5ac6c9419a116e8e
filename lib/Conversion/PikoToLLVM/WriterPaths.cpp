// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "WriterPaths.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

// Byte offsets of the members of pikoir_writer and pikoir_port.
namespace layout {
constexpr int64_t writerFlags = 12, ports = 24;
constexpr int64_t cursor = 0, limit = 8, size = 16, emitted = 24, kept = 32,
                  cellCursor = 40, cellEnd = 48, lastCell = 56, cells = 64,
                  run = 96, portFlags = 116, portSize = 120;
} // namespace layout
/// PIKOIR_FIRST_CELL
static constexpr int64_t firstCell = int64_t(1) << 31;
/// PIKOIR_PORT_LOCAL
static constexpr int64_t localFlag = 16;

namespace {

/// Writes loads and stores of a struct's members, and conditions on them.
class MemberBuilder {
public:
  MemberBuilder(OpBuilder &builder, Location loc, Value base, ArrayAttr tag)
      : builder(builder), loc(loc), base(base), tag(tag) {}

  Type pointer() { return LLVM::LLVMPointerType::get(builder.getContext()); }
  Type i64() { return builder.getI64Type(); }
  Type i32() { return builder.getI32Type(); }

  Value load(int64_t member, Type type) {
    return createLoad(builder, loc, type,
                      createOffset(builder, loc, base, member), tag);
  }
  void store(Value value, int64_t member) {
    createStore(builder, loc, value, createOffset(builder, loc, base, member),
                tag);
  }
  void increment(int64_t member) {
    Value one = createI64(builder, loc, 1);
    store(arith::AddIOp::create(builder, loc, load(member, i64()), one),
          member);
  }
  Value comparePointers(LLVM::ICmpPredicate predicate, Value a, Value b) {
    return LLVM::ICmpOp::create(builder, loc, predicate, a, b);
  }
  Value compare(arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  /// Whether any of these flags is set.
  Value any(int64_t flags, int64_t mask = -1) {
    Value set = arith::AndIOp::create(builder, loc, load(flags, i32()),
                                      createI32(builder, loc, mask));
    return compare(arith::CmpIPredicate::ne, set, createI32(builder, loc, 0));
  }
  Value either(Value a, Value b) {
    return arith::OrIOp::create(builder, loc, a, b);
  }

  OpBuilder &builder;
  Location loc;
  Value base;
  ArrayAttr tag; // of what a writer holds
};

} // namespace

static MemberBuilder openPort(OpBuilder &builder, Location loc,
                              LoweringContext &context, Value writer,
                              int64_t port) {
  MemberBuilder members(builder, loc, writer, context.tags.writer());
  Value ports = members.load(layout::ports, members.pointer());
  return {builder, loc,
          createOffset(builder, loc, ports, port * layout::portSize),
          members.tag};
}

Value piko::createAppend(OpBuilder &builder, Location loc,
                         LoweringContext &context, Value writer, int64_t port) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value record = out.load(layout::cursor, out.pointer());
  Value full = out.comparePointers(LLVM::ICmpPredicate::ugt, record,
                                   out.load(layout::limit, out.pointer()));
  Value isSlow = out.either(full, out.any(layout::portFlags, ~localFlag));
  auto path = scf::IfOp::create(builder, loc, out.pointer(), isSlow,
                                /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  Value room = context
                   .call(builder, loc, "pikoir_append", out.pointer(),
                         {writer, createI32(builder, loc, port)})
                   .getResult();
  scf::YieldOp::create(builder, loc, room);
  builder.setInsertionPointToStart(path.elseBlock());
  out.increment(layout::emitted);
  Value isPlaced =
      out.compare(arith::CmpIPredicate::ne, out.load(layout::cells, out.i64()),
                  createI64(builder, loc, 0));
  scf::IfOp::create(
      builder, loc, isPlaced,
      [&](OpBuilder &, Location) {
        out.store(createI64(builder, loc, -1), layout::lastCell);
        scf::YieldOp::create(builder, loc);
      },
      [&](OpBuilder &, Location) {
        Value size = out.load(layout::size, out.i64());
        out.store(createOffset(builder, loc, record, size), layout::cursor);
        scf::YieldOp::create(builder, loc);
      });
  scf::YieldOp::create(builder, loc, record);
  return path.getResult(0);
}

/// Calls pikoir_place under a condition; what is written next is otherwise.
static void callPlaceIf(Value isSlow, OpBuilder &builder, Location loc,
                        LoweringContext &context, Value writer, int64_t port,
                        Value cell) {
  auto path = scf::IfOp::create(builder, loc, isSlow, /*withElseRegion=*/true);
  builder.setInsertionPointToStart(path.thenBlock());
  context.call(builder, loc, "pikoir_place", Type(),
               {writer, createI32(builder, loc, port), cell});
  builder.setInsertionPointToStart(path.elseBlock());
}

void piko::createLocalPlace(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer,
                            int64_t port, Value cell) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value zero = createI64(builder, loc, 0);
  Value last = out.load(layout::lastCell, out.i64());
  Value isSlow =
      out.either(out.either(out.compare(arith::CmpIPredicate::ne, cell, zero),
                            out.compare(arith::CmpIPredicate::ne, last,
                                        createI64(builder, loc, -1))),
                 out.any(layout::portFlags, ~localFlag));
  OpBuilder::InsertionGuard guard(builder);
  callPlaceIf(isSlow, builder, loc, context, writer, port, cell);
  Value cursor = out.load(layout::cursor, out.pointer());
  Value size = out.load(layout::size, out.i64());
  out.store(createOffset(builder, loc, cursor, size), layout::cursor);
  out.store(cell, layout::lastCell);
}

void piko::createPlace(OpBuilder &builder, Location loc,
                       LoweringContext &context, Value writer, int64_t port,
                       Value cell) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value last = out.load(layout::lastCell, out.i64());
  Value place = out.load(layout::cellCursor, out.pointer());
  Value isSlow = out.either(
      out.either(out.compare(arith::CmpIPredicate::sle, cell, last),
                 out.compare(arith::CmpIPredicate::sge, cell,
                             out.load(layout::cells, out.i64()))),
      out.either(out.comparePointers(LLVM::ICmpPredicate::eq, place,
                                     out.load(layout::cellEnd, out.pointer())),
                 out.any(layout::portFlags)));
  OpBuilder::InsertionGuard guard(builder);
  callPlaceIf(isSlow, builder, loc, context, writer, port, cell);
  Value isFirst =
      out.compare(arith::CmpIPredicate::slt, last, createI64(builder, loc, 0));
  auto first = scf::IfOp::create(builder, loc, isFirst,
                                 /*withElseRegion=*/false);
  builder.setInsertionPointToStart(first.thenBlock());
  Value size = out.load(layout::size, out.i64());
  Value cursor = out.load(layout::cursor, out.pointer());
  out.store(createOffset(builder, loc, cursor, size), layout::cursor);
  out.store(place, layout::run);
  out.increment(layout::kept);
  builder.setInsertionPointAfter(first);
  Value mark = arith::SelectOp::create(builder, loc, isFirst,
                                       createI32(builder, loc, firstCell),
                                       createI32(builder, loc, 0));
  Value entry = arith::TruncIOp::create(builder, loc, out.i32(), cell);
  entry = arith::OrIOp::create(builder, loc, entry, mark);
  createStore(builder, loc, entry, place, out.tag);
  out.store(createOffset(builder, loc, place, 4), layout::cellCursor);
  out.store(cell, layout::lastCell);
}

void piko::createNext(OpBuilder &builder, Location loc,
                      LoweringContext &context, Value writer) {
  MemberBuilder members(builder, loc, writer, context.tags.writer());
  auto path = scf::IfOp::create(builder, loc, members.any(layout::writerFlags),
                                /*withElseRegion=*/false);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  context.call(builder, loc, "pikoir_next", Type(), writer);
}
