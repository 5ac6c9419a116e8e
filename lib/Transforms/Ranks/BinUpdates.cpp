// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-bin-updates: a stage whose only bin is the whole domain, and that
// updates the pixel that its primitive names, gets bins of a size. The calls
// for a pixel are in one bin as before, and in order.

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

namespace piko {
#define GEN_PASS_DEF_BINUPDATES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct BinUpdatesPass : piko::impl::BinUpdatesBase<BinUpdatesPass> {
  void runOnOperation() override;
  void getDependentDialects(DialectRegistry &registry) const override {
    registry.insert<arith::ArithDialect>();
  }
};
} // namespace

/// Whether an operation gives the same wherever it is done, and cannot fail.
static bool isMovable(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op))
    return bool(lookupInPipeline<ConstantOp>(load, load.getStateAttr()));
  return op->getNumRegions() == 0 && isMemoryEffectFree(op) &&
         isSpeculatable(op) && !isa<BinOp, BinLoOp, BinHiOp>(op);
}

/// Whether a value follows from the primitive alone.
static bool isOfPrimitive(Value value, ProcessOp process) {
  if (auto argument = dyn_cast<BlockArgument>(value))
    return argument.getOwner()->getParentOp() == process;
  Operation *op = value.getDefiningOp();
  return isMovable(op) && llvm::all_of(op->getOperands(), [&](Value operand) {
           return isOfPrimitive(operand, process);
         });
}

/// Whether two phases compute the same of a primitive.
static bool areSame(Value a, Value b) {
  auto first = dyn_cast<BlockArgument>(a), second = dyn_cast<BlockArgument>(b);
  if (first || second)
    return first && second && first.getType() == second.getType() &&
           isa<AssignOp, ProcessOp>(first.getOwner()->getParentOp()) &&
           isa<AssignOp, ProcessOp>(second.getOwner()->getParentOp());
  Operation *left = a.getDefiningOp(), *right = b.getDefiningOp();
  return left->getName() == right->getName() &&
         left->getAttrDictionary() == right->getAttrDictionary() &&
         left->getNumOperands() == right->getNumOperands() &&
         cast<OpResult>(a).getResultNumber() ==
             cast<OpResult>(b).getResultNumber() &&
         llvm::all_of(llvm::zip(left->getOperands(), right->getOperands()),
                      [](auto pair) {
                        return areSame(std::get<0>(pair), std::get<1>(pair));
                      });
}

static Value cloneInto(OpBuilder &builder, Value value, IRMapping &mapping) {
  if (Value known = mapping.lookupOrNull(value))
    return known;
  Operation *op = value.getDefiningOp();
  for (Value operand : op->getOperands())
    cloneInto(builder, operand, mapping);
  builder.clone(*op, mapping);
  return mapping.lookup(value);
}

/// The coordinates of all updates, or none.
static std::optional<OperandRange> findPixel(ProcessOp process) {
  std::optional<OperandRange> pixel;
  bool isOne = true;
  process.walk([&](Operation *op) {
    isOne &= !isa<BinOp, BinLoOp, BinHiOp>(op);
    auto update = dyn_cast<UpdateOp>(op);
    if (!update)
      return;
    if (!pixel)
      pixel = update.getCoordinates();
    isOne &= llvm::equal(*pixel, update.getCoordinates());
  });
  if (!pixel || !isOne || !llvm::all_of(*pixel, [&](Value coordinate) {
        return isOfPrimitive(coordinate, process);
      }))
    return std::nullopt;
  return pixel;
}

/// Whether the phase puts each primitive into the bin of a pixel.
static bool isBinOf(AssignOp assign, OperandRange pixel) {
  BinAtOp at;
  for (Operation &op : assign.getBody().front()) {
    if (auto to = dyn_cast<AssignToOp>(op))
      at = to.getBin().getDefiningOp<BinAtOp>();
    else if (isa<AssignmentOpInterface>(op) || op.getNumRegions() > 0)
      return false;
  }
  return at &&
         llvm::all_of(llvm::zip(at.getCoordinates(), pixel), [](auto pair) {
           return areSame(std::get<0>(pair), std::get<1>(pair));
         });
}

/// Whether bins of another size would be seen, otherwise than by pixels.
static bool showsBins(StageOp stage) {
  ScheduleOp schedule = stage.getSchedule();
  if (schedule && (schedule.getEveryBin() || !schedule.getBody().empty()))
    return true;
  bool shows = false;
  PipelineOp pipeline = getPipeline(stage);
  for (auto edge : pipeline.getOps<EdgeOp>()) {
    if (edge.getProducer() != stage.getSymName())
      continue;
    // What it emits would begin a lineage bin by bin.
    shows |= stage.collects();
    auto to = lookupInPipeline<StageOp>(edge, edge.getConsumerAttr());
    if (AssignOp assign = to.getAssign())
      assign.walk([&](AssignPreviousOp) { shows = true; });
  }
  return shows;
}

static void addAssign(StageOp stage, OperandRange pixel) {
  OpBuilder builder = OpBuilder::atBlockBegin(stage.getBodyBlock());
  Location loc = stage.getLoc();
  ProcessOp process = stage.getProcess();
  auto assign = AssignOp::create(builder, loc, FlatSymbolRefAttr(),
                                 IntegerAttr(), IntegerAttr());
  Block *body = builder.createBlock(&assign.getBody());
  IRMapping mapping;
  for (BlockArgument argument : process.getBody().getArguments())
    mapping.map(argument, body->addArgument(argument.getType(), loc));
  SmallVector<Value> coordinates;
  for (Value coordinate : pixel)
    coordinates.push_back(cloneInto(builder, coordinate, mapping));
  Value bin = BinAtOp::create(builder, loc, coordinates);
  // A pixel outside of the domain is for the process phase to report.
  Value first = arith::ConstantIndexOp::create(builder, loc, 0);
  bin = arith::MaxSIOp::create(builder, loc, bin, first);
  AssignToOp::create(builder, loc, bin);
  ReturnOp::create(builder, loc);
}

void BinUpdatesPass::runOnOperation() {
  constexpr int64_t sides[] = {1024, 32, 16, 8}; // by the domain's dimensions
  for (auto stage : getOperation().getOps<StageOp>()) {
    ProcessOp process = stage.getProcess();
    if (!process || !stage.isWholeDomain() || stage.getTakesList() ||
        showsBins(stage))
      continue;
    std::optional<OperandRange> pixel = findPixel(process);
    AssignOp assign = stage.getAssign();
    if (!pixel || (assign && !isBinOf(assign, *pixel)))
      continue;
    if (!assign)
      addAssign(stage, *pixel);
    size_t rank = stage.getBins().size();
    stage.setBins(SmallVector<int64_t>(rank, sides[rank - 1]));
    stage.emitRemark() << "stage '" << getCppName(stage)
                       << "' gets bins of a size, which ranks can share";
    ++binned;
  }
}
