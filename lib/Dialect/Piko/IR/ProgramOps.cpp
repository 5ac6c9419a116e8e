// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The run of a pipeline.

#include "IsolatedBody.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "StageUses.h"

#include "mlir/IR/OpImplementation.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// What kernels take and emit
//===----------------------------------------------------------------------===//

ProgramOp piko::getProgram(PipelineOp pipeline) {
  for (auto program : pipeline.getOps<ProgramOp>())
    return program;
  return {};
}

LaunchOp piko::findLaunch(KernelOp kernel) {
  SmallVector<LaunchOp> launches;
  if (ProgramOp program = getProgram(getPipeline(kernel)))
    program.walk([&](LaunchOp launch) {
      if (launch.getKernel() == kernel.getSymName())
        launches.push_back(launch);
    });
  return launches.size() == 1 ? launches.front() : LaunchOp();
}

SmallVector<StageOp> piko::getStages(KernelOp kernel) {
  SmallVector<StageOp> stages;
  auto add = [&](FlatSymbolRefAttr name) {
    if (auto stage = name ? lookupInPipeline<StageOp>(kernel, name) : StageOp())
      stages.push_back(stage);
  };
  for (auto process : kernel.getOps<ProcessOp>())
    add(process.getStageAttr());
  for (auto bins : kernel.getOps<BinsOp>())
    for (auto work : bins.getOps<WorkOpInterface>())
      add(work.getStageAttr());
  for (auto bins : kernel.getOps<OpenBinsOp>()) {
    if (bins.getSource())
      continue;
    add(bins.getStageAttr());
    kernel.walk([&](LocalBinOp local) {
      if (!llvm::is_contained(
              stages, lookupInPipeline<StageOp>(kernel, local.getStageAttr())))
        add(local.getStageAttr());
    });
  }
  return stages;
}

std::optional<int64_t> piko::getAssignedSource(KernelOp kernel) {
  for (auto assign : kernel.getOps<AssignOp>())
    if (assign.getSource())
      return *assign.getSource();
  for (auto items : kernel.getOps<ItemsOp>())
    if (items.getSource())
      return *items.getSource();
  for (auto bins : kernel.getOps<OpenBinsOp>())
    if (bins.getSource())
      return *bins.getSource();
  return std::nullopt;
}

bool piko::isLocal(EdgeOp edge) {
  if (edge.getLocal())
    return true;
  for (auto kernel : getPipeline(edge).getOps<KernelOp>())
    for (auto barrier : kernel.getOps<LocalBarrierOp>())
      if (barrier.getConsumerAttr() == edge.getConsumerAttr())
        return true;
  return false;
}

SmallVector<EdgeOp> piko::getEmittedEdges(KernelOp kernel) {
  SmallVector<EdgeOp> edges;
  for (StageOp stage : getStages(kernel)) {
    size_t first = edges.size();
    for (auto edge : getPipeline(kernel).getOps<EdgeOp>())
      if (edge.getProducer() == stage.getSymName() && !isLocal(edge))
        edges.push_back(edge);
    llvm::sort(edges.begin() + first, edges.end(),
               [](EdgeOp a, EdgeOp b) { return a.getPort() < b.getPort(); });
  }
  return edges;
}

static SourceOp findSource(Operation *op, int64_t number) {
  for (auto [n, source] : llvm::enumerate(getPipeline(op).getOps<SourceOp>()))
    if (int64_t(n) == number)
      return source;
  return {};
}

SourceOp FeedOp::getSourceOp() { return findSource(*this, getSource()); }

StageOp JoinOp::getStageOp() {
  return lookupInPipeline<StageOp>(*this, getStageAttr());
}

KernelOp LaunchOp::getKernelOp() {
  return lookupInPipeline<KernelOp>(*this, getKernelAttr());
}

//===----------------------------------------------------------------------===//
// Where primitives come from
//===----------------------------------------------------------------------===//

/// What ends a region of a program, or null where it is not there yet.
static LeaveOp getLeave(Operation *region) {
  Region &body = region->getRegion(0);
  if (body.empty() || body.front().empty())
    return {};
  return dyn_cast<LeaveOp>(body.front().back());
}

/// One step back; null where the primitives begin, or if the IR is wrong.
static Value getPrevious(Value edge) {
  auto at = [](ValueRange values, size_t i) {
    return i < values.size() ? values[i] : Value();
  };
  if (auto result = dyn_cast<OpResult>(edge)) {
    Operation *op = result.getOwner();
    if (auto exchange = dyn_cast<ExchangeOp>(op))
      return exchange.getEdge();
    LeaveOp leave =
        isa<StripsOp, WavesOp, RoundsOp>(op) ? getLeave(op) : LeaveOp();
    return leave ? at(leave.getLeaving(), result.getResultNumber()) : Value();
  }
  auto argument = cast<BlockArgument>(edge);
  Operation *op = argument.getOwner()->getParentOp();
  size_t entries = op->getNumOperands();
  if (argument.getArgNumber() < entries)
    return op->getOperand(argument.getArgNumber());
  LeaveOp leave = getLeave(op);
  return leave ? at(leave.getAround(), argument.getArgNumber() - entries)
               : Value();
}

Operation *piko::getOrigin(Value edge) {
  // A region that passes its own argument around would have no end.
  for (int steps = 0; edge && steps < 1000; ++steps) {
    if (auto feed = edge.getDefiningOp<FeedOp>())
      return feed.getSourceOp();
    auto launch = edge.getDefiningOp<LaunchOp>();
    if (!launch) {
      edge = getPrevious(edge);
      continue;
    }
    KernelOp kernel = launch.getKernelOp();
    if (!kernel)
      return nullptr;
    if (auto source = getAssignedSource(kernel))
      return findSource(launch, *source);
    SmallVector<EdgeOp> edges = getEmittedEdges(kernel);
    size_t number = cast<OpResult>(edge).getResultNumber();
    return number < edges.size() ? edges[number].getOperation() : nullptr;
  }
  return nullptr;
}

//===----------------------------------------------------------------------===//
// Assembly
//===----------------------------------------------------------------------===//

static ParseResult parseSymbols(OpAsmParser &parser, ArrayAttr &names) {
  SmallVector<Attribute> list;
  if (parser.parseCommaSeparatedList([&] {
        FlatSymbolRefAttr name;
        if (parser.parseAttribute(name))
          return failure();
        list.push_back(name);
        return success();
      }))
    return failure();
  names = parser.getBuilder().getArrayAttr(list);
  return success();
}

static void printSymbols(OpAsmPrinter &printer, Operation *, ArrayAttr names) {
  llvm::interleaveComma(names, printer);
}

// (concatenate %a keys 1, permute %b)
static ParseResult
parseGathers(OpAsmParser &parser,
             SmallVectorImpl<OpAsmParser::UnresolvedOperand> &edges,
             DenseBoolArrayAttr &permutes, DenseI64ArrayAttr &keys) {
  SmallVector<bool> permuted;
  SmallVector<int64_t> widths;
  auto parseEdge = [&]() -> ParseResult {
    bool isPermuted = succeeded(parser.parseOptionalKeyword("permute"));
    if (!isPermuted && parser.parseKeyword("concatenate", " or 'permute'"))
      return failure();
    permuted.push_back(isPermuted);
    widths.push_back(0);
    if (parser.parseOperand(edges.emplace_back()))
      return failure();
    if (succeeded(parser.parseOptionalKeyword("keys")))
      return parser.parseInteger(widths.back());
    return success();
  };
  if (parser.parseCommaSeparatedList(AsmParser::Delimiter::Paren, parseEdge))
    return failure();
  permutes = parser.getBuilder().getDenseBoolArrayAttr(permuted);
  keys = parser.getBuilder().getDenseI64ArrayAttr(widths);
  return success();
}

static void printGathers(OpAsmPrinter &printer, Operation *, ValueRange edges,
                         DenseBoolArrayAttr permutes, DenseI64ArrayAttr keys) {
  printer << "(";
  llvm::interleaveComma(
      llvm::seq<size_t>(0, edges.size()), printer, [&](size_t i) {
        printer << (permutes[i] ? "permute " : "concatenate ") << edges[i];
        if (keys[i] != 0)
          printer << " keys " << keys[i];
      });
  printer << ")";
}

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoProgramOps.cpp.inc"

//===----------------------------------------------------------------------===//
// Verification of statements
//===----------------------------------------------------------------------===//

LogicalResult ClearOp::verify() {
  for (auto name : getStates().getAsRange<FlatSymbolRefAttr>()) {
    auto *state = lookupInPipeline<Operation *>(*this, name);
    auto buffer = dyn_cast_or_null<BufferOp>(state);
    if (!isa_and_nonnull<ImageOp>(state) && !(buffer && buffer.getPerSource()))
      return emitOpError("expected an image, or a buffer that is sized by a "
                         "source, but got ")
             << name << ", which is none";
  }
  return success();
}

static LogicalResult verifyRecord(Operation *op, Type type,
                                  FlatSymbolRefAttr expected) {
  auto record = isa<EdgeType>(type) ? cast<EdgeType>(type).getRecord()
                                    : cast<BinsType>(type).getRecord();
  if (record == expected)
    return success();
  return op->emitOpError("expected record ")
         << expected << ", but got " << record;
}

LogicalResult FeedOp::verify() {
  SourceOp source = getSourceOp();
  if (!source)
    return emitOpError("expected a source, but got ")
           << getSource() << ", which is none";
  auto stage = lookupInPipeline<StageOp>(source, source.getStageAttr());
  return stage ? verifyRecord(*this, getEdge().getType(), stage.getInputAttr())
               : success(); // the source has an error
}

LogicalResult WaitOp::verify() { return verifyStage(*this, getStageAttr()); }

LogicalResult ScheduleBinsOp::verify() {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  auto stage = lookupInPipeline<StageOp>(*this, getStageAttr());
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && !schedule.getBody().empty())
    return success();
  return emitOpError("expected a stage whose schedule has a body, but got ")
         << getStageAttr();
}

/// Whether all that comes to a stage comes to its join, each once.
static LogicalResult verifyOrigins(JoinOp join) {
  FlatSymbolRefAttr stage = join.getStageAttr();
  llvm::SmallDenseSet<Operation *> missing, seen;
  for (Operation &op : *getPipeline(join).getBodyBlock()) {
    auto edge = dyn_cast<EdgeOp>(op);
    auto source = dyn_cast<SourceOp>(op);
    if ((edge && edge.getConsumerAttr() == stage && !isLocal(edge)) ||
        (source && source.getStageAttr() == stage))
      missing.insert(&op);
  }
  for (auto [number, edge] : llvm::enumerate(join.getEdges())) {
    Operation *origin = getOrigin(edge);
    if (!missing.erase(origin))
      return join.emitOpError("expected edge ")
             << number << " to lead to " << stage
             << ", and each edge that leads there once";
  }
  if (!missing.empty())
    return join.emitOpError("expected all that leads to ")
           << stage << ", but " << missing.size() << " of its edges are not "
           << "joined";
  return success();
}

LogicalResult JoinOp::verify() {
  if (failed(verifyStage(*this, getStageAttr())))
    return failure();
  if (getPermutes().size() != getEdges().size() ||
      getKeys().size() != getEdges().size())
    return emitOpError("expected a way to gather and a key for each edge");
  StageOp stage = getStageOp();
  for (Type type : getOperandTypes())
    if (failed(verifyRecord(*this, type, stage.getInputAttr())))
      return failure();
  if (failed(verifyRecord(*this, getBins().getType(), stage.getInputAttr())) ||
      failed(verifyOrigins(*this)))
    return failure();
  if (llvm::any_of(getKeys(), [](int64_t width) { return width < 0; }))
    return emitOpError("expected keys of at least one word");
  // What goes around in waves has no keys, and is not merged by them.
  if (isa<WavesOp>((*this)->getParentOp()))
    return success();
  if (getMerge() && getEdges().size() < 2)
    return emitOpError("expected several edges to merge");
  if (getMerge() && llvm::is_contained(getKeys(), 0))
    return emitOpError("expected keys to merge by");
  return success();
}

/// Whether what a launch takes is of the kernel's stage or source.
static LogicalResult verifyInput(LaunchOp launch, KernelOp kernel) {
  SmallVector<StageOp> stages = getStages(kernel);
  bool takesEdge = getAssignedSource(kernel).has_value();
  Type type = launch.getInput() ? launch.getInput().getType() : Type();
  if (takesEdge        ? !isa_and_nonnull<EdgeType>(type)
      : stages.empty() ? bool(type)
                       : !isa_and_nonnull<BinsType>(type))
    return launch.emitOpError("expected the kernel to take ")
           << (takesEdge        ? "an edge"
               : stages.empty() ? "nothing"
                                : "bins");
  if (takesEdge) {
    auto source = dyn_cast_or_null<SourceOp>(getOrigin(launch.getInput()));
    if (!source || source != findSource(launch, *getAssignedSource(kernel)))
      return launch.emitOpError("expected what source ")
             << *getAssignedSource(kernel) << " holds";
    return success();
  }
  auto join = type ? launch.getInput().getDefiningOp<JoinOp>() : JoinOp();
  if (type && (!join || join.getStageOp() != stages.front()))
    return launch.emitOpError("expected the bins of ")
           << FlatSymbolRefAttr::get(stages.front().getSymNameAttr());
  return success();
}

/// The images that a kernel's tiles clear, as names.
static llvm::SmallSetVector<Attribute, 4> findClears(KernelOp kernel) {
  llvm::SmallSetVector<Attribute, 4> images;
  kernel.walk([&](TileOp tile) {
    if (tile.getClear())
      images.insert(tile.getImageAttr());
  });
  return images;
}

/// Whether a launch clears what the tiles of its kernel do, and nothing else
/// does.
static LogicalResult verifyClears(LaunchOp launch) {
  auto tiles = findClears(launch.getKernelOp());
  if (!launch.getClearsAttr() && tiles.empty())
    return success();
  llvm::SmallSetVector<Attribute, 4> images;
  if (ArrayAttr clears = launch.getClearsAttr())
    images.insert(clears.begin(), clears.end());
  // A target may have made arrays of tiles.
  bool isLoops = !launch.getKernelOp().getOps<OpenBinsOp>().empty();
  for (Attribute image : images)
    if (!isLoops && !tiles.contains(image))
      return launch.emitOpError("expected a tile in ")
             << launch.getKernelAttr()
             << " that begins with the clear value of " << image;
  for (Attribute image : tiles)
    if (!images.contains(image))
      return launch.emitOpError("expected to clear ")
             << image << ", as the tile in " << launch.getKernelAttr()
             << " does";
  if (launch->getParentOfType<WavesOp>() || launch->getParentOfType<RoundsOp>())
    return launch.emitOpError("expected to clear images only where it is sure "
                              "to run, but it is in a cycle");
  WalkResult others =
      launch->getParentOfType<ProgramOp>().walk([&](ClearOp clear) {
        for (Attribute image : images)
          if (llvm::is_contained(clear.getStates(), image)) {
            launch.emitOpError("expected ")
                << image << " to be cleared once, but 'piko.clear' does, too";
            return WalkResult::interrupt();
          }
        return WalkResult::advance();
      });
  return failure(others.wasInterrupted());
}

LogicalResult LaunchOp::verify() {
  KernelOp kernel = getKernelOp();
  if (!kernel)
    return emitOpError("expected a kernel, but got ")
           << getKernelAttr() << ", which is none";
  if (failed(verifyInput(*this, kernel)))
    return failure();
  if (getTurn() && !isa<RoundsOp>((*this)->getParentOp()))
    return emitOpError("expected a turn in rounds alone");
  if (failed(verifyClears(*this)))
    return failure();
  SmallVector<FlatSymbolRefAttr> records;
  if (getAssignedSource(kernel)) {
    records.push_back(cast<EdgeType>(getInput().getType()).getRecord());
  } else {
    for (EdgeOp edge : getEmittedEdges(kernel)) {
      auto consumer = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
      if (!consumer)
        return success(); // the edge has an error
      records.push_back(consumer.getInputAttr());
    }
  }
  if (getEdges().size() != records.size())
    return emitOpError("expected ")
           << records.size() << " results, one for each port, but got "
           << getEdges().size();
  for (auto [edge, record] : llvm::zip(getEdges(), records))
    if (failed(verifyRecord(*this, edge.getType(), record)))
      return failure();
  return success();
}

//===----------------------------------------------------------------------===//
// Verification of regions
//===----------------------------------------------------------------------===//

/// Whether a region's arguments, its end and its results are of one type each.
static LogicalResult verifyRegion(Operation *op, bool goesAround) {
  Block &body = op->getRegion(0).front();
  LeaveOp leave = getLeave(op);
  if (!leave)
    return op->emitOpError("expected a piko.leave at its end");
  if (!goesAround && !leave.getAround().empty())
    return leave.emitOpError("expected nothing to go around");
  SmallVector<Type> arguments(op->getOperandTypes());
  llvm::append_range(arguments, leave.getAround().getTypes());
  if (arguments != SmallVector<Type>(body.getArgumentTypes()))
    return op->emitOpError("expected an argument for each edge that comes in")
           << (goesAround ? " or goes around" : "") << ", of its type";
  if (SmallVector<Type>(leave.getLeaving().getTypes()) !=
      SmallVector<Type>(op->getResultTypes()))
    return op->emitOpError("expected a result for each edge that leaves, of "
                           "its type");
  return success();
}

LogicalResult StripsOp::verifyRegions() {
  if (!isa_and_nonnull<SourceOp>(getOrigin(getSource())) ||
      !isa<FeedOp>(getSource().getDefiningOp()))
    return emitOpError("expected what a piko.feed gives");
  return verifyRegion(*this, /*goesAround=*/false);
}

LogicalResult WavesOp::verifyRegions() {
  return verifyRegion(*this, /*goesAround=*/true);
}

LogicalResult RoundsOp::verifyRegions() {
  return verifyRegion(*this, /*goesAround=*/true);
}

namespace {
/// Checks what holds across the statements of a program.
struct ProgramVerifier {
  LogicalResult visit(Operation *op);
  LogicalResult checkUses(Operation *op, ValueRange values);
  LogicalResult checkAll(ProgramOp program);

  llvm::DenseMap<Attribute, Operation *> launches;
  llvm::DenseSet<Attribute> stages;
  llvm::DenseSet<int64_t> sources;
};
} // namespace

LogicalResult ProgramVerifier::checkUses(Operation *op, ValueRange values) {
  for (Value value : values)
    if (!value.hasOneUse())
      return op->emitOpError("expected each edge to be used once, but one of "
                             "its edges has ")
             << std::distance(value.use_begin(), value.use_end()) << " uses";
  return success();
}

LogicalResult ProgramVerifier::visit(Operation *op) {
  for (Region &region : op->getRegions())
    if (!region.empty() && failed(checkUses(op, region.getArguments())))
      return failure();
  if (failed(checkUses(op, op->getResults())))
    return failure();
  if (auto feed = dyn_cast<FeedOp>(op))
    if (!sources.insert(feed.getSource()).second)
      return feed.emitOpError("expected source ")
             << feed.getSource() << " to be fed once";
  if (auto wait = dyn_cast<WaitOp>(op))
    if (!stages.contains(wait.getStageAttr().getAttr()))
      return wait.emitOpError("expected the kernel of ")
             << wait.getStageAttr() << " to be launched before";
  auto launch = dyn_cast<LaunchOp>(op);
  if (!launch)
    return success();
  auto [first, fresh] = launches.try_emplace(launch.getKernelAttr(), launch);
  if (!fresh) {
    InFlightDiagnostic error = launch.emitOpError("expected each kernel to be "
                                                  "launched at one place, but ")
                               << launch.getKernelAttr() << " is at two";
    error.attachNote(first->second->getLoc()) << "it is here, too";
    return error;
  }
  for (StageOp stage : getStages(launch.getKernelOp()))
    stages.insert(stage.getSymNameAttr());
  return success();
}

LogicalResult ProgramVerifier::checkAll(ProgramOp program) {
  PipelineOp pipeline = getPipeline(program);
  for (auto kernel : pipeline.getOps<KernelOp>())
    if (!kernel.getPrecedes() &&
        !launches.contains(FlatSymbolRefAttr::get(kernel.getSymNameAttr())))
      return program.emitOpError("expected a launch of ")
             << FlatSymbolRefAttr::get(kernel.getSymNameAttr());
  for (auto [number, source] : llvm::enumerate(pipeline.getOps<SourceOp>()))
    if (!sources.contains(number))
      return program.emitOpError("expected a feed of source ") << number;
  return success();
}

LogicalResult ProgramOp::verifyRegions() {
  for (Operation &op : *getBodyBlock())
    if (!isa<ClearOp, FeedOp, ScheduleBinsOp, JoinOp, LaunchOp, WaitOp,
             StripsOp, WavesOp, RoundsOp, PartitionOp, CommonOp, ExchangeOp,
             KeepOp, ShareOp>(op))
      return op.emitOpError("expected only statements of a program");
  for (Attribute name :
       getRootsAttr() ? getRootsAttr().getValue() : ArrayRef<Attribute>()) {
    auto stage =
        lookupInPipeline<StageOp>(*this, cast<FlatSymbolRefAttr>(name));
    if (!stage || !stage.collects())
      return emitOpError("expected a stage that collects, but got ") << name;
  }
  ProgramVerifier verifier;
  WalkResult result = getBody().walk<WalkOrder::PreOrder>(
      [&](Operation *op) { return WalkResult(verifier.visit(op)); });
  return result.wasInterrupted() ? failure() : verifier.checkAll(*this);
}
