// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A kernel is a nest of parts: a bin, its primitives, the iterations of
// parallel loops, the iterations of others. An access belongs to the innermost
// part around it, but a field of a primitive to the part that has the
// primitive, because it is read once and kept.

#include "Piko/Analysis/KernelTraffic.h"

#include "mlir/Interfaces/LoopLikeInterface.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/SetVector.h"

#include <map>
#include <vector>

using namespace mlir;
using namespace piko;

namespace {

class TrafficFinder {
public:
  explicit TrafficFinder(KernelOp kernel) {
    result.kernel = kernel.getSymName();
    open("block", 0);
  }
  void visit(Block &block, unsigned part, bool always);
  KernelTraffic take();

private:
  using Range = ByteRange TrafficPart::*;
  /// What is accessed, and by which values it is named.
  using Access = std::vector<const void *>;
  struct Counted {
    unsigned part;
    bool always;
  };

  void visit(Operation &op, unsigned part, bool always);
  void visitRegions(Operation &op, unsigned part, bool always);
  unsigned open(const Twine &per, unsigned parent);
  void enter(Operation &op, const Twine &per, unsigned part);
  void addField(GetOp get, unsigned part, bool always);
  template <typename OpT>
  void addElement(OpT access, Type type, Range range, unsigned part,
                  bool always);
  void addUpdate(UpdateOp update, unsigned part, bool always);
  void addTile(Operation &op, FlatSymbolRefAttr image, Range range,
               unsigned part);
  void addEmission(EmissionOpInterface emission);
  void add(Operation *access, Attribute what, ValueRange where, Type type,
           Range range, unsigned part, bool always);

  KernelTraffic result;
  std::map<Access, Counted> counted;
  /// The parts that primitives belong to.
  llvm::DenseMap<Value, unsigned> homes;
  llvm::SetVector<int64_t> ports;
};

} // namespace

static int64_t getBytes(Type type) {
  return std::max<int64_t>(type.getIntOrFloatBitWidth(), 8) / 8;
}

unsigned TrafficFinder::open(const Twine &per, unsigned parent) {
  TrafficPart part;
  part.per = per.str();
  part.depth = result.parts.empty() ? 0 : result.parts[parent].depth + 1;
  result.parts.push_back(std::move(part));
  return result.parts.size() - 1;
}

void TrafficFinder::visitRegions(Operation &op, unsigned part, bool always) {
  for (Region &region : op.getRegions())
    for (Block &block : region)
      visit(block, part, always);
}

void TrafficFinder::enter(Operation &op, const Twine &per, unsigned part) {
  unsigned inner = open(per, part);
  for (Region &region : op.getRegions())
    for (Value argument : region.getArguments())
      homes[argument] = inner;
  visitRegions(op, inner, /*always=*/true);
}

/// Counts an access once, and as one that always happens if one of its kind
/// does.
void TrafficFinder::add(Operation *access, Attribute what, ValueRange where,
                        Type type, Range range, unsigned part, bool always) {
  Access key = {access->getName().getAsOpaquePointer(),
                what.getAsOpaquePointer()};
  for (Value value : where)
    key.push_back(value.getAsOpaquePointer());
  int64_t bytes = getBytes(type);
  auto [known, isNew] = counted.try_emplace(key, Counted{part, always});
  if (isNew) {
    (result.parts[part].*range).add(bytes, always);
  } else if (always && !known->second.always) {
    (result.parts[known->second.part].*range).least += bytes;
    known->second.always = true;
  }
}

void TrafficFinder::addField(GetOp get, unsigned part, bool always) {
  SmallVector<Value> where(get.getElements());
  where.push_back(get.getPrim());
  auto home = homes.find(get.getPrim());
  if (home != homes.end()) {
    // What is inside of it may not run.
    always &= home->second == part;
    part = home->second;
  }
  add(get, get.getFieldAttr(), where, get.getType(), &TrafficPart::reads, part,
      always);
}

template <typename OpT>
void TrafficFinder::addElement(OpT access, Type type, Range range,
                               unsigned part, bool always) {
  if (lookupInPipeline<ConstantOp>(access, access.getStateAttr()))
    return;
  SmallVector<Value> where(access.getIndices());
  llvm::append_range(where, access.getElements());
  auto what = ArrayAttr::get(access->getContext(),
                             {access.getStateAttr(), access.getFieldAttr()});
  // Elsewhere it may be another element.
  auto here = ArrayAttr::get(
      access->getContext(),
      {what, IntegerAttr::get(IndexType::get(access->getContext()), part)});
  add(access, here, where, type, range, part, always);
}

void TrafficFinder::addUpdate(UpdateOp update, unsigned part, bool always) {
  if (update.getTile())
    return;
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  for (auto [old, now] : llvm::zip(body.getArguments(), yield.getPixel())) {
    if (!old.use_empty())
      result.parts[part].reads.add(getBytes(old.getType()), always);
    if (now != old)
      result.parts[part].writes.add(getBytes(now.getType()), always);
  }
}

void TrafficFinder::addTile(Operation &op, FlatSymbolRefAttr image, Range range,
                            unsigned part) {
  auto state = lookupInPipeline<ImageOp>(&op, image);
  RecordOp record = lookupRecord(&op, getStateRecord(state));
  unsigned pixel = open("pixel of the bin, of " + image.getValue(), part);
  (result.parts[pixel].*range).add(record.getSize(), /*always=*/true);
}

void TrafficFinder::addEmission(EmissionOpInterface emission) {
  if (!ports.insert(emission.getPort()))
    return;
  TrafficEmission &it = result.emissions.emplace_back();
  it.port = emission.getPort();
  StageOp stage = getKernelStage(emission);
  if (auto record = dyn_cast<FlatSymbolRefAttr>(stage.getOutputs()[it.port]))
    it.bytes = lookupRecord(emission, record).getSize();
  for (auto edge : getPipeline(emission).getOps<EdgeOp>())
    if (edge.getProducer() == stage.getSymName() && edge.getPort() == it.port)
      it.consumer = edge.getConsumer();
  emission->getParentOfType<KernelOp>().walk([&](WorkOpInterface work) {
    it.isLocal |= work.getProducerAttr() && work.getPortAttr() &&
                  work.getProducerAttr().getValue() == stage.getSymName() &&
                  work.getPortAttr().getInt() == it.port;
  });
}

void TrafficFinder::visit(Block &block, unsigned part, bool always) {
  for (Operation &op : block)
    visit(op, part, always);
}

void TrafficFinder::visit(Operation &op, unsigned part, bool always) {
  if (isa<BinsOp>(op))
    return enter(op, "bin", part);
  if (auto work = dyn_cast<WorkOpInterface>(op))
    return enter(op,
                 (work.takesList() ? "list of " : "primitive of ") +
                     work.getStageAttr().getValue(),
                 part);
  if (isa<ParallelPixelsOp>(op))
    return enter(op, "pixel", part);
  if (isa<ParallelLoopOpInterface>(op))
    return enter(op, "iteration of a parallel loop", part);
  if (isa<LoopLikeOpInterface>(op))
    return enter(op, "iteration of a loop", part);
  if (auto element = dyn_cast<ListAtOp>(op)) {
    homes[element.getResult()] = part;
  } else if (auto get = dyn_cast<GetOp>(op)) {
    addField(get, part, always);
  } else if (auto load = dyn_cast<LoadOp>(op)) {
    if (!load.getTile())
      addElement(load, load.getType(), &TrafficPart::reads, part, always);
  } else if (auto store = dyn_cast<StoreOp>(op)) {
    if (!store.getTile())
      addElement(store, store.getValue().getType(), &TrafficPart::writes, part,
                 always);
  } else if (auto atomic = dyn_cast<AtomicOp>(op)) {
    addElement(atomic, atomic.getValue().getType(), &TrafficPart::atomics, part,
               always);
  } else if (auto update = dyn_cast<UpdateOp>(op)) {
    addUpdate(update, part, always);
    visitRegions(op, part, always);
  } else if (auto tile = dyn_cast<TileOp>(op)) {
    if (!tile.getClear())
      addTile(op, tile.getImageAttr(), &TrafficPart::reads, part);
  } else if (auto write = dyn_cast<WriteTileOp>(op)) {
    addTile(op, write.getImageAttr(), &TrafficPart::writes, part);
  } else if (auto emission = dyn_cast<EmissionOpInterface>(op)) {
    addEmission(emission);
  } else if (auto place = dyn_cast<PlaceOp>(op)) {
    if (!llvm::is_contained(result.placements, place.getStage()))
      result.placements.push_back(place.getStage().str());
  } else if (isa<StateAccessOpInterface>(op)) {
    result.unknown.push_back(op.getName().getStringRef().str());
  } else {
    // Branches; what other operations hold runs as they do.
    visitRegions(op, part, always && !isa<RegionBranchOpInterface>(op));
  }
}

/// Without parts that move nothing; those inside of them move outwards.
KernelTraffic TrafficFinder::take() {
  std::vector<TrafficPart> kept;
  SmallVector<unsigned> around; // depths of those that are kept
  for (TrafficPart &part : result.parts) {
    while (!around.empty() && around.back() >= part.depth)
      around.pop_back();
    if (part.reads.most + part.writes.most + part.atomics.most == 0)
      continue;
    around.push_back(part.depth);
    part.depth = around.size() - 1;
    kept.push_back(std::move(part));
  }
  result.parts = std::move(kept);
  return std::move(result);
}

KernelTraffic piko::findKernelTraffic(KernelOp kernel) {
  TrafficFinder finder(kernel);
  finder.visit(*kernel.getBodyBlock(), 0, /*always=*/true);
  return finder.take();
}
