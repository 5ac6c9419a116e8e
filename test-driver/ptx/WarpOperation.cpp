// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- WarpOperation.cpp - Shuffles, votes, matches of PTX ----------------===//
//
// They wait until all lanes of their mask that live have come to them. A
// shuffle that asks a lane without part in it gets what nobody has written.
//
//===----------------------------------------------------------------------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

#include <algorithm>
#include <cstring>

using namespace piko::ptx;

namespace {

constexpr Type bits32{Kind::Bits, 32};
constexpr Type predicateType{Kind::Predicate, 1};

/// it.c: the mask of members. Whether they are all here.
bool gathered(Warp &warp, const Instruction &it) {
  const auto *masks = warp.lanes<uint32_t>(it.c);
  const auto first = static_cast<uint32_t>(std::countr_zero(warp.active));
  forEachLane(warp.active, [&](uint32_t lane) {
    if (masks[lane] != masks[first])
      warp.fault(FaultKind::IllegalInstruction,
                 "warp operation whose lanes have different masks", lane);
  });
  return warp.gather(masks[first]);
}

enum Shuffle : uint8_t { Up, Down, Butterfly, Index };

void shuffle(Warp &warp, const Instruction &it) {
  if (!gathered(warp, it))
    return;
  const auto *from = warp.lanes<uint32_t>(it.a);
  const auto *asked = warp.lanes<uint32_t>(it.b);
  const auto *clamps = warp.lanes<uint32_t>(warp.program->lists[it.extra][0]);
  std::array<uint32_t, warpSize> values;
  uint32_t inRange = 0;
  forEachLane(warp.active, [&](uint32_t lane) {
    uint32_t clamp = clamps[lane] & 31, segment = clamps[lane] >> 8 & 31;
    uint32_t distance = asked[lane] & 31, least = lane & segment;
    uint32_t most = least | (clamp & ~segment);
    auto source = static_cast<int32_t>(it.variant == Up     ? lane - distance
                                       : it.variant == Down ? lane + distance
                                       : it.variant == Butterfly
                                           ? lane ^ distance
                                           : least | (distance & ~segment));
    const auto bound = static_cast<int32_t>(most);
    bool inside = it.variant == Up ? source >= bound : source <= bound;
    uint32_t place = inside ? static_cast<uint32_t>(source) : lane;
    inRange |= uint32_t(inside) << lane;
    if (warp.active >> place & 1)
      values[lane] = from[place];
    else
      std::memset(&values[lane], unwritten, sizeof(uint32_t));
  });
  auto *result = warp.lanes<uint32_t>(it.result);
  forEachLane(warp.active, [&](uint32_t lane) { result[lane] = values[lane]; });
  if (it.count == 2)
    warp.setPredicate(it.second, inRange);
}

enum Vote : uint8_t { All, Any, Same, Ballot };

void vote(Warp &warp, const Instruction &it) {
  if (!gathered(warp, it))
    return;
  uint32_t given = warp.predicate(it.a);
  uint32_t yes = (it.negated ? ~given : given) & warp.active;
  if (it.variant == Ballot) {
    forEachLane(warp.active, [&](uint32_t lane) {
      warp.lanes<uint32_t>(it.result)[lane] = yes;
    });
    return;
  }
  bool holds = it.variant == All   ? yes == warp.active
               : it.variant == Any ? yes != 0
                                   : yes == warp.active || !yes;
  warp.setPredicate(it.result, holds ? allLanes : 0);
}

/// it.variant: whether all must have the same value.
template <typename T> void match(Warp &warp, const Instruction &it) {
  if (!gathered(warp, it))
    return;
  const T *values = warp.lanes<T>(it.a);
  std::array<uint32_t, warpSize> equal{};
  uint32_t all = allLanes;
  forEachLane(warp.active, [&](uint32_t lane) {
    equal[lane] = lanesWhere(warp.active,
                             [&](uint32_t other) {
                               return values[other] == values[lane];
                             }) &
                  warp.active;
    all &= equal[lane] == warp.active ? allLanes : 0;
  });
  forEachLane(warp.active, [&](uint32_t lane) {
    warp.lanes<uint32_t>(it.result)[lane] =
        it.variant ? equal[lane] & all : equal[lane];
  });
  if (it.count == 2)
    warp.setPredicate(it.second, all);
}

enum Reduction : uint8_t { Add, Min, Max, And, Or, Xor };

template <typename T> void reduce(Warp &warp, const Instruction &it) {
  if (!gathered(warp, it))
    return;
  const T *values = warp.lanes<T>(it.a);
  uint32_t rest = warp.active & (warp.active - 1);
  T sum = values[std::countr_zero(warp.active)];
  forEachLane(rest, [&](uint32_t lane) {
    T value = values[lane];
    sum = it.variant == Add   ? static_cast<T>(uint32_t(sum) + uint32_t(value))
          : it.variant == Min ? std::min(sum, value)
          : it.variant == Max ? std::max(sum, value)
          : it.variant == And ? sum & value
          : it.variant == Or  ? sum | value
                              : sum ^ value;
  });
  forEachLane(warp.active,
              [&](uint32_t lane) { warp.lanes<T>(it.result)[lane] = sum; });
}

void synchronize(Warp &warp, const Instruction &it) { gathered(warp, it); }

void activeMask(Warp &warp, const Instruction &it) {
  forEachLane(warp.active, [&](uint32_t lane) {
    warp.lanes<uint32_t>(it.result)[lane] = warp.active;
  });
}

/// Takes one of the names, in their order; what its number is.
uint8_t takeVariant(Decoding &d,
                    std::initializer_list<std::string_view> names) {
  uint8_t number = 0;
  for (std::string_view name : names) {
    if (d.take(name))
      return number;
    ++number;
  }
  d.fail("expected an operation that is known");
}

/// A result, or one and a predicate: d|p.
void takeResults(Decoding &d, Type type) {
  const Argument &given = d.argument(0);
  d.it.count = 1;
  if (given.kind != Argument::Pair) {
    d.it.result = d.result(0, type);
    return;
  }
  d.it.count = 2;
  d.it.result = d.result(given.parts[0], type);
  d.it.second = d.result(given.parts[1], predicateType);
}

void takeSync(Decoding &d) {
  if (!d.take("sync"))
    d.fail("expected .sync");
}

bool decodeShuffle(Decoding &d) {
  takeSync(d);
  Type type = d.takeType();
  d.it.variant = takeVariant(d, {"up", "down", "bfly", "idx"});
  d.finish(5);
  takeResults(d, type);
  d.it.run = shuffle;
  d.it.a = d.value(1, type);
  d.it.b = d.value(2, bits32);
  d.it.extra = d.scope.addList({d.value(3, bits32)});
  d.it.c = d.value(4, bits32);
  return true;
}

bool decodeVote(Decoding &d) {
  takeSync(d);
  Type type = d.takeType();
  d.it.variant = takeVariant(d, {"all", "any", "uni", "ballot"});
  d.finish(3);
  d.it.run = vote;
  d.it.result = d.result(0, type);
  if (type.isPredicate() == (d.it.variant == Ballot))
    d.fail("expected another type");
  d.it.a = d.predicate(1, &d.it.negated);
  d.it.c = d.value(2, bits32);
  return true;
}

bool decodeMatch(Decoding &d) {
  takeSync(d);
  Type type = d.takeType();
  d.it.variant = takeVariant(d, {"any", "all"});
  d.finish(3);
  d.it.run = type.bits == 64 ? match<uint64_t> : match<uint32_t>;
  takeResults(d, bits32);
  d.it.a = d.value(1, type);
  d.it.c = d.value(2, bits32);
  return true;
}

bool decodeReduction(Decoding &d) {
  takeSync(d);
  Type type = d.takeType();
  d.it.variant = takeVariant(d, {"add", "min", "max", "and", "or", "xor"});
  d.finish(3);
  d.it.run = type.isSigned() ? reduce<int32_t> : reduce<uint32_t>;
  d.it.result = d.result(0, type);
  d.it.a = d.value(1, type);
  d.it.c = d.value(2, bits32);
  return true;
}

bool decodeWarpBarrier(Decoding &d) {
  d.take("warp");
  takeSync(d);
  d.finish(1);
  d.it.run = synchronize;
  d.it.c = d.value(0, bits32);
  return true;
}

} // namespace

bool piko::ptx::decodeWarpOperation(Decoding &d) {
  std::string_view base = d.base();
  d.it.counted = Class::WarpOperation;
  if (base == "shfl")
    return decodeShuffle(d);
  if (base == "vote")
    return decodeVote(d);
  if (base == "match")
    return decodeMatch(d);
  if (base == "redux")
    return decodeReduction(d);
  if (base == "bar")
    return decodeWarpBarrier(d);
  if (base != "activemask")
    return false;
  Type type = d.takeType();
  d.finish(1);
  d.it.run = activeMask;
  d.it.result = d.result(0, type);
  return true;
}
