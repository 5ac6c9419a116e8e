// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-prune:
//   1. find what can be observed, and what that depends on (PipelineLiveness);
//   2. give each stage that only edges feed a record of the fields it needs;
//   3. erase what is computed for nothing;
//   4. take away stages of which nothing can be observed, with their edges, and
//      number ports anew.

#include "Authored/PipelineLiveness.h"

#include "Piko/Analysis/PhaseGraph.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/UB/IR/UBOps.h"

namespace piko {
#define GEN_PASS_DEF_PRUNE
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct PrunePass : piko::impl::PruneBase<PrunePass> {
  void runOnOperation() override;
};

/// Fields, and the record that holds no more than them.
struct Layout {
  SmallVector<Attribute> fields;
  int64_t size = 1, align = 1;
};

class Pruner {
public:
  explicit Pruner(PipelineOp pipeline)
      : pipeline(pipeline), liveness(pipeline) {}
  void run();

private:
  bool isFedBySource(StageOp stage);
  SmallVector<EdgeOp> edgesInto(StageOp stage);
  void collectWaits(StageOp stage, llvm::SetVector<Attribute> &waits,
                    llvm::SmallPtrSetImpl<Operation *> &seen);
  void rewriteWaits(StageOp stage);
  void removeDeadEdges();
  void removeDeadStages();
  void shrinkInput(StageOp stage);
  void replaceRecord(StageOp stage, RecordOp from, const Layout &layout);

  PipelineOp pipeline;
  PipelineLiveness liveness;
};

} // namespace

//===----------------------------------------------------------------------===//
// Bodies
//===----------------------------------------------------------------------===//

/// Something for a place whose value does not matter.
static Value createAnything(OpBuilder &builder, Location loc, Type type) {
  if (type.isIntOrIndexOrFloat())
    return arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type));
  return ub::PoisonOp::create(builder, loc, type);
}

/// Erases what is not live in a phase of a live stage.
static void sweep(Operation *phase, const PipelineLiveness &liveness) {
  SmallVector<Operation *> dead;
  phase->walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op == phase || op->hasTrait<OpTrait::IsTerminator>() ||
        liveness.isLive(op))
      return WalkResult::advance();
    dead.push_back(op);
    return WalkResult::skip(); // what is in it goes with it
  });
  for (Operation *op : llvm::reverse(dead)) {
    OpBuilder builder(op);
    for (Value result : op->getResults())
      if (!result.use_empty())
        result.replaceAllUsesWith(
            createAnything(builder, op->getLoc(), result.getType()));
    op->erase();
  }
}

/// Erases all that a phase does; whether there was anything.
static bool clear(Operation *phase) {
  if (!phase)
    return false;
  Block &body = phase->getRegion(0).front();
  bool isEmpty = llvm::hasSingleElement(body);
  while (!llvm::hasSingleElement(body))
    std::prev(body.end(), 2)->erase();
  return !isEmpty;
}

//===----------------------------------------------------------------------===//
// Records
//===----------------------------------------------------------------------===//

/// The fields of a record that pass `keep`, without room between them: as
/// declared, or in order of alignment where that is smaller.
static Layout layOut(RecordOp record, function_ref<bool(FieldAttr)> keep) {
  SmallVector<FieldAttr> fields(llvm::make_filter_range(
      record.getFields().getAsRange<FieldAttr>(), keep));
  auto bytesOf = [](FieldAttr field) -> int64_t {
    return field.getType().getIntOrFloatBitWidth() / 8;
  };
  auto place = [&](ArrayRef<unsigned> order) {
    Layout layout;
    layout.fields.resize(fields.size());
    int64_t end = 0;
    for (unsigned i : order) {
      FieldAttr field = fields[i];
      int64_t bytes = bytesOf(field), stride = bytes;
      SmallVector<int64_t> strides(field.getCounts().size());
      for (size_t d = strides.size(); d-- > 0; stride *= field.getCounts()[d])
        strides[d] = stride;
      end = llvm::alignTo(end, bytes);
      layout.fields[i] =
          FieldAttr::get(record.getContext(), field.getName(), field.getType(),
                         end, field.getCounts(), strides);
      end += bytes * field.getElementCount();
      layout.align = std::max(layout.align, bytes);
    }
    layout.size = llvm::alignTo(std::max<int64_t>(end, 1), layout.align);
    return layout;
  };
  auto order = llvm::to_vector(llvm::seq<unsigned>(0, fields.size()));
  Layout declared = place(order);
  llvm::sort(order, [&](unsigned a, unsigned b) {
    return std::pair(-bytesOf(fields[a]), a) <
           std::pair(-bytesOf(fields[b]), b);
  });
  Layout sorted = place(order);
  return sorted.size < declared.size ? sorted : declared;
}

/// Gives the primitives of a stage, which are all of one record, another one.
static void setRecord(StageOp stage, FlatSymbolRefAttr record) {
  MLIRContext *context = stage.getContext();
  auto convert = [&](Value value) {
    if (isa<PrimType>(value.getType()))
      value.setType(PrimType::get(context, record));
    else if (isa<ListType>(value.getType()))
      value.setType(ListType::get(context, record));
  };
  stage.setInputAttr(record);
  stage.walk([&](Operation *op) {
    llvm::for_each(op->getResults(), convert);
    for (Region &region : op->getRegions())
      for (Block &block : region)
        llvm::for_each(block.getArguments(), convert);
  });
}

/// Whether any pipeline names the record.
static bool isUsed(RecordOp record) {
  auto name = FlatSymbolRefAttr::get(record.getSymNameAttr());
  return record->getParentOfType<ModuleOp>()
      .walk([&](Operation *op) {
        auto stage = dyn_cast<StageOp>(op);
        bool uses = stage ? stage.getInputAttr() == name ||
                                llvm::is_contained(stage.getOutputs(), name)
                          : getStateRecord(op) == name;
        return uses ? WalkResult::interrupt() : WalkResult::advance();
      })
      .wasInterrupted();
}

void Pruner::shrinkInput(StageOp stage) {
  SmallVector<EdgeOp> edges = edgesInto(stage);
  if (edges.empty() || isFedBySource(stage))
    return; // the layout is the host's
  RecordOp record = lookupRecord(stage, stage.getInputAttr());
  auto keep = [&](FieldAttr field) { return liveness.isLive(stage, field); };
  Layout layout = layOut(record, keep);
  int64_t dropped = record.getFields().size() - layout.fields.size();
  if (dropped == 0 && layout.size >= record.getSize())
    return;
  for (EdgeOp edge : edges) {
    InFlightDiagnostic remark = edge.emitRemark("edge to stage '")
                                << getCppName(stage) << "' carries "
                                << layout.size << " instead of "
                                << record.getSize() << " bytes";
    if (dropped == 0)
      continue;
    Diagnostic &note = remark.attachNote(stage.getLoc());
    note << "nothing depends on";
    for (auto field : record.getFields().getAsRange<FieldAttr>())
      if (!keep(field))
        note << " '" << field.getName() << "'";
  }
  replaceRecord(stage, record, layout);
}

void Pruner::replaceRecord(StageOp stage, RecordOp from, const Layout &layout) {
  auto module = pipeline->getParentOfType<ModuleOp>();
  std::string stem = (from.getSymName() + "." + stage.getSymName()).str();
  std::string name = stem;
  for (int i = 0; module.lookupSymbol(name); ++i)
    name = stem + "_" + std::to_string(i);
  OpBuilder builder(from->getContext());
  builder.setInsertionPointAfter(from);
  RecordOp::create(builder, from.getLoc(), name,
                   builder.getArrayAttr(layout.fields), layout.size,
                   layout.align);

  SmallVector<bool> kept; // for each number of the old record
  for (auto field : from.getFields().getAsRange<FieldAttr>())
    kept.append(field.getElementCount(), liveness.isLive(stage, field));
  for (EdgeOp edge : edgesInto(stage)) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    auto outputs = llvm::to_vector(producer.getOutputs());
    outputs[edge.getPort()] = FlatSymbolRefAttr::get(from.getContext(), name);
    producer.setOutputsAttr(builder.getArrayAttr(outputs));
    producer.walk([&](EmitOp emit) {
      if (emit.getPort() != edge.getPort())
        return;
      SmallVector<Value> values;
      for (auto [value, keep] : llvm::zip(emit.getValues(), kept))
        if (keep)
          values.push_back(value);
      emit.getValuesMutable().assign(values);
    });
  }
  setRecord(stage, FlatSymbolRefAttr::get(from.getContext(), name));
  if (!isUsed(from))
    from.erase();
}

//===----------------------------------------------------------------------===//
// The graph
//===----------------------------------------------------------------------===//

bool Pruner::isFedBySource(StageOp stage) {
  return llvm::any_of(pipeline.getOps<SourceOp>(), [&](SourceOp source) {
    return source.getStage() == stage.getSymName();
  });
}

SmallVector<EdgeOp> Pruner::edgesInto(StageOp stage) {
  return llvm::to_vector(
      llvm::make_filter_range(pipeline.getOps<EdgeOp>(), [&](EdgeOp edge) {
        return edge.getConsumer() == stage.getSymName();
      }));
}

static SmallVector<StageOp> waitsOf(StageOp stage) {
  SmallVector<StageOp> waits;
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && schedule.getEndStageAttr())
    for (auto name : schedule.getEndStageAttr().getAsRange<FlatSymbolRefAttr>())
      waits.push_back(lookupInPipeline<StageOp>(stage, name));
  return waits;
}

/// A stage that waits for one without effect waits for all that this one would
/// have had to wait for.
void Pruner::collectWaits(StageOp stage, llvm::SetVector<Attribute> &waits,
                          llvm::SmallPtrSetImpl<Operation *> &seen) {
  if (!seen.insert(stage).second)
    return;
  bool isLive = liveness.isLive(stage);
  if (isLive || isFedBySource(stage))
    waits.insert(FlatSymbolRefAttr::get(stage.getSymNameAttr()));
  if (isLive)
    return;
  for (StageOp producer : liveness.producersOf(stage))
    collectWaits(producer, waits, seen);
  for (StageOp other : waitsOf(stage))
    collectWaits(other, waits, seen);
}

void Pruner::rewriteWaits(StageOp stage) {
  SmallVector<StageOp> before = waitsOf(stage);
  if (llvm::all_of(before, [&](StageOp s) { return liveness.isLive(s); }))
    return;
  llvm::SetVector<Attribute> waits;
  llvm::SmallPtrSet<Operation *, 8> seen;
  for (StageOp other : before)
    collectWaits(other, waits, seen);
  // Never empty, so that the stage still collects: above a stage without effect
  // there is one that a source feeds.
  stage.getSchedule().setEndStageAttr(
      ArrayAttr::get(stage.getContext(), waits.getArrayRef()));
}

/// Edges from or to stages without effect; the ports of others move up.
void Pruner::removeDeadEdges() {
  OpBuilder builder(pipeline.getContext());
  llvm::DenseMap<std::pair<Operation *, int64_t>, EdgeOp> edges;
  for (auto edge : pipeline.getOps<EdgeOp>())
    edges[{lookupInPipeline<StageOp>(edge, edge.getProducerAttr()),
           edge.getPort()}] = edge;
  for (auto stage : pipeline.getOps<StageOp>()) {
    SmallVector<Attribute> outputs;
    SmallVector<int64_t> newPorts;
    for (auto [port, record] : llvm::enumerate(stage.getOutputs())) {
      EdgeOp edge = edges.at({stage, int64_t(port)});
      newPorts.push_back(outputs.size());
      if (liveness.isLive(
              lookupInPipeline<StageOp>(edge, edge.getConsumerAttr()))) {
        edge.setPort(outputs.size());
        outputs.push_back(record);
      } else {
        edge.erase();
      }
    }
    if (outputs.size() == newPorts.size())
      continue;
    stage.setOutputsAttr(builder.getArrayAttr(outputs));
    stage.walk([&](EmitOp emit) { emit.setPort(newPorts[emit.getPort()]); });
  }
}

/// Those that a source feeds stay, for the host, but do nothing.
void Pruner::removeDeadStages() {
  for (auto stage : llvm::to_vector(pipeline.getOps<StageOp>())) {
    if (liveness.isLive(stage))
      continue;
    bool isKept = isFedBySource(stage);
    if (isKept &&
        !(int(clear(stage.getProcess())) | int(clear(stage.getAssign()))))
      continue;
    stage.emitRemark("stage '")
        << getCppName(stage) << "' is " << (isKept ? "emptied" : "removed")
        << ", because nothing it does can be observed";
    if (!isKept)
      stage.erase();
  }
}

void Pruner::run() {
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    if (!edge.getCarried())
      edge.setCarried(lookupRecord(edge, consumer.getInputAttr()).getSize());
  }
  for (auto stage : pipeline.getOps<StageOp>()) {
    rewriteWaits(stage);
    if (liveness.isLive(stage))
      shrinkInput(stage);
  }
  // Now nothing live takes what is not, but for places that do not matter.
  for (auto stage : pipeline.getOps<StageOp>())
    if (liveness.isLive(stage))
      for (Operation &phase : *stage.getBodyBlock())
        if (isa<ProcessOp, AssignOp>(phase))
          sweep(&phase, liveness);
  removeDeadEdges();
  removeDeadStages();
}

void PrunePass::runOnOperation() {
  for (auto pipeline : getOperation().getOps<PipelineOp>()) {
    // A run that is checked reports what breaks a rule, be it observed or not.
    if (!pipeline.getOps<CheckRecordOp>().empty())
      continue;
    // Numbers are taken away from emissions, and ports get other numbers.
    pipeline.walk([](EmissionOpInterface emission) { asEmit(emission); });
    Pruner(pipeline).run();
  }
}
