// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "PikoToLLVM/Records/WriterPaths.h"

#include "PikoToLLVM/Lanes/LaneBits.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "pikort/emission.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

using namespace mlir;
using namespace piko;

namespace {

/// Calls what is inline of a port.
struct PortCode : CodeBuilder {
  PortCode(OpBuilder &builder, Location loc, LoweringContext &context,
           Value writer, int64_t port)
      : CodeBuilder(builder, loc), context(context), writer(writer),
        port(createI32(builder, loc, port)) {}

  LLVM::CallOp call(const RuntimeFunction &function,
                    ValueRange arguments = {}) {
    return context.call(builder, loc, function, withPort(arguments));
  }
  Value test(const RuntimeFunction &function, ValueRange arguments = {}) {
    return context.test(builder, loc, function, withPort(arguments));
  }
  SmallVector<Value> withPort(ValueRange arguments) {
    SmallVector<Value> all{writer, port};
    llvm::append_range(all, arguments);
    return all;
  }

  LoweringContext &context;
  Value writer, port;
};

} // namespace

/// How many records lanes emit.
static Value countRecords(CodeBuilder &code, const LaneEmissions &emissions) {
  Value count;
  for (Value bits : emissions.bits) {
    Value ones = math::CtPopOp::create(code.builder, code.loc, bits);
    count = count ? code.add(count, ones) : ones;
  }
  return count;
}

void piko::createAppendLanes(OpBuilder &builder, Location loc,
                             LoweringContext &context, Value writer,
                             const LaneEmissions &emissions) {
  PortCode code(builder, loc, context, writer, emissions.port);
  code.call(PIKO_RUNTIME_FUNCTION(pikoir_append_lanes_inline),
            countRecords(code, emissions));
}

/// The runtime's way for each record.
static void createPlaceEach(PortCode &code, const LaneEmissions &emissions) {
  OpBuilder &builder = code.builder;
  Location loc = code.loc;
  Value zero = createI64(builder, loc, 0);
  code.forEach(
      code.index(0), code.index(emissions.lanes), code.index(1),
      [&](Value lane) {
        Value shift = toI64(builder, loc, lane);
        for (auto [bits, buckets] :
             llvm::zip(emissions.bits, emissions.buckets)) {
          Value rest = arith::ShRUIOp::create(builder, loc, bits, shift);
          Value bit = code.both(rest, createI64(builder, loc, 1));
          code.when(code.compare(CodeBuilder::P::ne, bit, zero), [&] {
            Value bucket =
                vector::ExtractOp::create(builder, loc, buckets, lane);
            code.call(PIKO_RUNTIME_FUNCTION(pikoir_place_apart_inline), bucket);
          });
        }
      });
}

/// Whether there is a bucket that a lane in the mask names and that is none.
static Value createIsOutside(PortCode &code, const LaneEmissions &emissions) {
  auto words = cast<VectorType>(emissions.buckets.front().getType());
  Value buckets =
      code.call(PIKO_RUNTIME_FUNCTION(pikoir_buckets_inline)).getResult();
  Value most =
      vector::BroadcastOp::create(code.builder, code.loc, words, buckets);
  Value outside;
  for (auto [bits, buckets] : llvm::zip(emissions.bits, emissions.buckets)) {
    Value bad = createBits(code.builder, code.loc,
                           code.compare(CodeBuilder::P::uge, buckets, most));
    bad = code.both(bad, bits);
    outside = outside ? code.either(outside, bad) : bad;
  }
  return code.compare(CodeBuilder::P::ne, outside,
                      createI64(code.builder, code.loc, 0));
}

/// Notes the buckets of the lanes one after the other, each as the first of its
/// record; the place after them. A lane that is not in the mask leaves its own
/// to be written over.
static Value noteBuckets(PortCode &code, const LaneEmissions &emissions,
                         Value place) {
  OpBuilder &builder = code.builder;
  Location loc = code.loc;
  Type entries = VectorType::get({emissions.lanes}, builder.getI32Type());
  Value first = vector::BroadcastOp::create(
      builder, loc, entries,
      createI32(builder, loc, int64_t(PIKOIR_FIRST_BUCKET)));
  SmallVector<Value> noted;
  for (Value buckets : emissions.buckets)
    noted.push_back(code.either(
        arith::TruncIOp::create(builder, loc, entries, buckets), first));
  for (int64_t lane = 0; lane < emissions.lanes; ++lane)
    for (auto [bits, buckets] : llvm::zip(emissions.bits, noted)) {
      createStore(builder, loc,
                  vector::ExtractOp::create(builder, loc, buckets, lane), place,
                  code.context.tags.writer());
      place = createOffset(
          builder, loc, place,
          createLaneOffset(builder, loc, bits, lane, sizeof(uint32_t)));
    }
  return place;
}

void piko::createPlaceLanes(OpBuilder &builder, Location loc,
                            LoweringContext &context, Value writer,
                            const LaneEmissions &emissions, bool isLocal) {
  PortCode code(builder, loc, context, writer, emissions.port);
  Value isOutside = createIsOutside(code, emissions);
  int64_t records = emissions.lanes * int64_t(emissions.bits.size());
  Value isApart =
      isLocal
          ? code.test(PIKO_RUNTIME_FUNCTION(pikoir_places_apart_local_inline))
          : code.test(PIKO_RUNTIME_FUNCTION(pikoir_places_apart_inline),
                      createI64(builder, loc, records));
  auto path = scf::IfOp::create(builder, loc, code.either(isOutside, isApart),
                                /*withElseRegion=*/true);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(path.thenBlock());
  createPlaceEach(code, emissions);
  builder.setInsertionPointToStart(path.elseBlock());
  Value count = countRecords(code, emissions);
  if (isLocal) {
    code.call(PIKO_RUNTIME_FUNCTION(pikoir_place_lanes_local_inline), count);
    return;
  }
  Value place =
      code.call(PIKO_RUNTIME_FUNCTION(pikoir_place_lanes_inline), count)
          .getResult();
  code.call(PIKO_RUNTIME_FUNCTION(pikoir_end_buckets_inline),
            noteBuckets(code, emissions, place));
}
