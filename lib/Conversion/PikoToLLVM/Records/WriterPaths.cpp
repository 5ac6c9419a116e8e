// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "PikoToLLVM/Records/WriterPaths.h"

#include "PikoToLLVM/Lanes/LaneBits.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

// Members of pikoir_writer and pikoir_port.
namespace layout {
constexpr RuntimeMember writerFlags = PIKO_RUNTIME_MEMBER(pikoir_writer, flags),
                        ports = PIKO_RUNTIME_MEMBER(pikoir_writer, ports),
                        mappings = PIKO_RUNTIME_MEMBER(pikoir_writer, mappings);
constexpr RuntimeMember cursor = PIKO_RUNTIME_MEMBER(pikoir_port, cursor),
                        limit = PIKO_RUNTIME_MEMBER(pikoir_port, limit),
                        size = PIKO_RUNTIME_MEMBER(pikoir_port, size),
                        emitted = PIKO_RUNTIME_MEMBER(pikoir_port, emitted),
                        kept = PIKO_RUNTIME_MEMBER(pikoir_port, kept),
                        bucketCursor =
                            PIKO_RUNTIME_MEMBER(pikoir_port, bucket_cursor),
                        bucketEnd =
                            PIKO_RUNTIME_MEMBER(pikoir_port, bucket_end),
                        lastBucket =
                            PIKO_RUNTIME_MEMBER(pikoir_port, last_bucket),
                        buckets = PIKO_RUNTIME_MEMBER(pikoir_port, buckets),
                        run = PIKO_RUNTIME_MEMBER(pikoir_port, run),
                        portFlags = PIKO_RUNTIME_MEMBER(pikoir_port, flags);
} // namespace layout

namespace {

/// Writes loads and stores of a struct's members, and conditions on them.
struct MemberBuilder : CodeBuilder {
  MemberBuilder(OpBuilder &builder, Location loc, Value base, ArrayAttr tag)
      : CodeBuilder(builder, loc), base(base), tag(tag) {}

  Type pointer() { return LLVM::LLVMPointerType::get(builder.getContext()); }
  Type i32() { return builder.getI32Type(); }

  Value load(const RuntimeMember &member) {
    return createLoad(builder, loc,
                      convertType(builder.getContext(), member.type),
                      createOffset(builder, loc, base, member.offset), tag);
  }
  void store(Value value, const RuntimeMember &member) {
    createStore(builder, loc, value,
                createOffset(builder, loc, base, member.offset), tag);
  }
  void increment(const RuntimeMember &member) {
    Value one = createI64(builder, loc, 1);
    store(add(load(member), one), member);
  }
  Value comparePointers(LLVM::ICmpPredicate predicate, Value a, Value b) {
    return LLVM::ICmpOp::create(builder, loc, predicate, a, b);
  }
  /// Whether any of these flags is set.
  Value any(const RuntimeMember &flags, int64_t mask = -1) {
    Value set = both(load(flags), createI32(builder, loc, mask));
    return compare(P::ne, set, createI32(builder, loc, 0));
  }

  Value base;
  ArrayAttr tag; // of what a writer holds
};

} // namespace

Value piko::createTakesVectors(OpBuilder &builder, Location loc,
                               LoweringContext &context, Value writer,
                               int64_t number) {
  MemberBuilder members(builder, loc, writer, context.tags.writer());
  Value bit = createI64(builder, loc, int64_t(1) << number);
  Value set = members.both(members.load(layout::mappings), bit);
  return members.compare(MemberBuilder::P::ne, set, createI64(builder, loc, 0));
}

static MemberBuilder openPort(OpBuilder &builder, Location loc,
                              LoweringContext &context, Value writer,
                              int64_t port) {
  MemberBuilder members(builder, loc, writer, context.tags.writer());
  Value ports = members.load(layout::ports);
  return {
      builder, loc,
      createOffset(builder, loc, ports, port * int64_t(sizeof(pikoir_port))),
      members.tag};
}

Value piko::createAppend(OpBuilder &builder, Location loc,
                         LoweringContext &context, Value writer, int64_t port) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value record = out.load(layout::cursor);
  Value full = out.comparePointers(LLVM::ICmpPredicate::ugt, record,
                                   out.load(layout::limit));
  Value isSlow =
      out.either(full, out.any(layout::portFlags,
                               ~(PIKOIR_PORT_LOCAL | PIKOIR_PORT_COUNTS)));
  auto path = scf::IfOp::create(builder, loc, out.pointer(), isSlow,
                                /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  Value room = context
                   .call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_append),
                         {writer, createI32(builder, loc, port)})
                   .getResult();
  scf::YieldOp::create(builder, loc, room);
  builder.setInsertionPointToStart(path.elseBlock());
  out.increment(layout::emitted);
  Value isPlaced = out.compare(MemberBuilder::P::ne, out.load(layout::buckets),
                               createI64(builder, loc, 0));
  scf::IfOp::create(
      builder, loc, isPlaced,
      [&](OpBuilder &, Location) {
        out.store(createI64(builder, loc, -1), layout::lastBucket);
        scf::YieldOp::create(builder, loc);
      },
      [&](OpBuilder &, Location) {
        Value size = out.load(layout::size);
        out.store(createOffset(builder, loc, record, size), layout::cursor);
        scf::YieldOp::create(builder, loc);
      });
  scf::YieldOp::create(builder, loc, record);
  return path.getResult(0);
}

/// Calls pikoir_place under a condition; what is written next is otherwise.
static void callPlaceIf(Value isSlow, OpBuilder &builder, Location loc,
                        LoweringContext &context, Value writer, int64_t port,
                        Value bucket) {
  auto path = scf::IfOp::create(builder, loc, isSlow, /*withElseRegion=*/true);
  builder.setInsertionPointToStart(path.thenBlock());
  context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_place),
               {writer, createI32(builder, loc, port), bucket});
  builder.setInsertionPointToStart(path.elseBlock());
}

void piko::createLocalPlace(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer,
                            int64_t port, Value bucket) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value last = out.load(layout::lastBucket);
  Value isSlow = out.either(
      out.either(
          out.compare(MemberBuilder::P::uge, bucket, out.load(layout::buckets)),
          out.compare(MemberBuilder::P::ne, last, createI64(builder, loc, -1))),
      out.any(layout::portFlags, ~PIKOIR_PORT_LOCAL));
  OpBuilder::InsertionGuard guard(builder);
  callPlaceIf(isSlow, builder, loc, context, writer, port, bucket);
  Value cursor = out.load(layout::cursor);
  Value size = out.load(layout::size);
  out.store(createOffset(builder, loc, cursor, size), layout::cursor);
  out.store(bucket, layout::lastBucket);
}

void piko::createPlace(OpBuilder &builder, Location loc,
                       LoweringContext &context, Value writer, int64_t port,
                       Value bucket) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value last = out.load(layout::lastBucket);
  Value place = out.load(layout::bucketCursor);
  Value isSlow =
      out.either(out.either(out.compare(MemberBuilder::P::sle, bucket, last),
                            out.compare(MemberBuilder::P::sge, bucket,
                                        out.load(layout::buckets))),
                 out.either(out.comparePointers(LLVM::ICmpPredicate::eq, place,
                                                out.load(layout::bucketEnd)),
                            out.any(layout::portFlags, ~(PIKOIR_PORT_COUNTS |
                                                         PIKOIR_PORT_SOURCE))));
  OpBuilder::InsertionGuard guard(builder);
  callPlaceIf(isSlow, builder, loc, context, writer, port, bucket);
  Value isFirst =
      out.compare(MemberBuilder::P::slt, last, createI64(builder, loc, 0));
  auto first = scf::IfOp::create(builder, loc, isFirst,
                                 /*withElseRegion=*/false);
  builder.setInsertionPointToStart(first.thenBlock());
  Value size = out.load(layout::size);
  Value cursor = out.load(layout::cursor);
  out.store(createOffset(builder, loc, cursor, size), layout::cursor);
  out.store(place, layout::run);
  out.increment(layout::kept);
  builder.setInsertionPointAfter(first);
  Value mark =
      out.select(isFirst, createI32(builder, loc, int64_t(PIKOIR_FIRST_BUCKET)),
                 createI32(builder, loc, 0));
  Value entry = arith::TruncIOp::create(builder, loc, out.i32(), bucket);
  createStore(builder, loc, out.either(entry, mark), place, out.tag);
  out.store(createOffset(builder, loc, place, 4), layout::bucketCursor);
  out.store(bucket, layout::lastBucket);
}

Value piko::createReserve(OpBuilder &builder, Location loc,
                          LoweringContext &context, Value writer, int64_t port,
                          int64_t count) {
  MemberBuilder out = openPort(builder, loc, context, writer, port);
  Value size = out.load(layout::size);
  Value last = createOffset(builder, loc, out.load(layout::cursor),
                            out.mul(size, createI64(builder, loc, count - 1)));
  Value isSlow = out.comparePointers(LLVM::ICmpPredicate::ugt, last,
                                     out.load(layout::limit));
  out.when(isSlow, [&] {
    context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_reserve),
                 {writer, createI32(builder, loc, port),
                  createI64(builder, loc, count)});
  });
  return out.load(layout::cursor);
}

/// How many records lanes emit.
static Value countRecords(MemberBuilder &out, const LaneEmissions &emissions) {
  Value count;
  for (Value bits : emissions.bits) {
    Value ones = math::CtPopOp::create(out.builder, out.loc, bits);
    count = count ? out.add(count, ones) : ones;
  }
  return count;
}

void piko::createAppendLanes(OpBuilder &builder, Location loc,
                             LoweringContext &context, Value writer,
                             const LaneEmissions &emissions) {
  MemberBuilder out = openPort(builder, loc, context, writer, emissions.port);
  Value count = countRecords(out, emissions);
  out.store(out.add(out.load(layout::emitted), count), layout::emitted);
  // Records that are put nowhere are not kept.
  Value zero = createI64(builder, loc, 0);
  Value isKept =
      out.compare(MemberBuilder::P::eq, out.load(layout::buckets), zero);
  Value bytes =
      out.mul(out.select(isKept, count, zero), out.load(layout::size));
  out.store(createOffset(builder, loc, out.load(layout::cursor), bytes),
            layout::cursor);
}

/// The runtime's way for each record.
static void createPlaceEach(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer,
                            const LaneEmissions &emissions) {
  MemberBuilder out = openPort(builder, loc, context, writer, emissions.port);
  Value zero = createI64(builder, loc, 0);
  out.forEach(
      out.index(0), out.index(emissions.lanes), out.index(1), [&](Value lane) {
        Value shift = toI64(builder, loc, lane);
        for (auto [bits, buckets] :
             llvm::zip(emissions.bits, emissions.buckets)) {
          Value rest = arith::ShRUIOp::create(builder, loc, bits, shift);
          Value bit = out.both(rest, createI64(builder, loc, 1));
          out.when(out.compare(MemberBuilder::P::ne, bit, zero), [&] {
            out.increment(layout::emitted);
            out.store(createI64(builder, loc, -1), layout::lastBucket);
            context.call(
                builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_place),
                {writer, createI32(builder, loc, emissions.port),
                 vector::ExtractOp::create(builder, loc, buckets, lane)});
          });
        }
      });
}

/// Whether there is a bucket that a lane in the mask names and that is none.
static Value createIsOutside(MemberBuilder &out, const LaneEmissions &emissions,
                             Value bucketCount) {
  auto words = cast<VectorType>(emissions.buckets.front().getType());
  Value most =
      vector::BroadcastOp::create(out.builder, out.loc, words, bucketCount);
  Value outside;
  for (auto [bits, buckets] : llvm::zip(emissions.bits, emissions.buckets)) {
    Value bad = createBits(out.builder, out.loc,
                           out.compare(MemberBuilder::P::uge, buckets, most));
    bad = out.both(bad, bits);
    outside = outside ? out.either(outside, bad) : bad;
  }
  return out.compare(MemberBuilder::P::ne, outside,
                     createI64(out.builder, out.loc, 0));
}

/// Notes the buckets of the lanes one after the other, each as the first of its
/// record. A lane that is not in the mask leaves its own to be written over.
static void noteBuckets(MemberBuilder &out, const LaneEmissions &emissions) {
  OpBuilder &builder = out.builder;
  Location loc = out.loc;
  Type entries = VectorType::get({emissions.lanes}, out.i32());
  Value first = vector::BroadcastOp::create(
      builder, loc, entries,
      createI32(builder, loc, int64_t(PIKOIR_FIRST_BUCKET)));
  SmallVector<Value> noted;
  for (Value buckets : emissions.buckets)
    noted.push_back(out.either(
        arith::TruncIOp::create(builder, loc, entries, buckets), first));
  Value place = out.load(layout::bucketCursor);
  for (int64_t lane = 0; lane < emissions.lanes; ++lane)
    for (auto [bits, buckets] : llvm::zip(emissions.bits, noted)) {
      createStore(builder, loc,
                  vector::ExtractOp::create(builder, loc, buckets, lane), place,
                  out.tag);
      place = createOffset(
          builder, loc, place,
          createLaneOffset(builder, loc, bits, lane, sizeof(uint32_t)));
    }
  out.store(place, layout::bucketCursor);
}

void piko::createPlaceLanes(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer,
                            const LaneEmissions &emissions, bool isLocal) {
  MemberBuilder out = openPort(builder, loc, context, writer, emissions.port);
  Value isSlow = createIsOutside(out, emissions, out.load(layout::buckets));
  if (!isLocal) {
    auto bytes = int64_t(sizeof(uint32_t)) * emissions.lanes *
                 int64_t(emissions.bits.size());
    Value room = out.comparePointers(
        LLVM::ICmpPredicate::ugt,
        createOffset(builder, loc, out.load(layout::bucketCursor), bytes),
        out.load(layout::bucketEnd));
    isSlow = out.either(isSlow, room);
  }
  isSlow = out.either(
      isSlow, out.any(layout::portFlags, isLocal ? ~PIKOIR_PORT_LOCAL : -1));
  auto path = scf::IfOp::create(builder, loc, isSlow, /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  createPlaceEach(builder, loc, context, writer, emissions);
  builder.setInsertionPointToStart(path.elseBlock());
  Value count = countRecords(out, emissions);
  out.store(out.add(out.load(layout::emitted), count), layout::emitted);
  Value bytes = out.mul(count, out.load(layout::size));
  out.store(createOffset(builder, loc, out.load(layout::cursor), bytes),
            layout::cursor);
  if (isLocal)
    return;
  out.store(out.add(out.load(layout::kept), count), layout::kept);
  noteBuckets(out, emissions);
}

Value piko::createIsCounted(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer) {
  MemberBuilder members(builder, loc, writer, context.tags.writer());
  return members.any(layout::writerFlags);
}

void piko::createSourceNext(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer) {
  MemberBuilder out = openPort(builder, loc, context, writer, /*port=*/0);
  Value isNowhere =
      out.compare(MemberBuilder::P::slt, out.load(layout::lastBucket),
                  createI64(builder, loc, 0));
  scf::IfOp::create(
      builder, loc, isNowhere,
      [&](OpBuilder &, Location) {
        context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_next), writer);
        scf::YieldOp::create(builder, loc);
      },
      [&](OpBuilder &, Location) {
        out.store(createI64(builder, loc, -1), layout::lastBucket);
        scf::YieldOp::create(builder, loc);
      });
}

void piko::createNext(OpBuilder &builder, Location loc,
                      LoweringContext &context, Value writer) {
  auto path = scf::IfOp::create(builder, loc,
                                createIsCounted(builder, loc, context, writer),
                                /*withElseRegion=*/false);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  context.call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_next), writer);
}
