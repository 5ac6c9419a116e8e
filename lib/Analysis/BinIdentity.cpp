//===- BinIdentity.cpp - Assignments that keep a primitive in its bin -----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/BinIdentity.h"

#include "Piko/Analysis/PhaseGraph.h"

#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

Operation *piko::getOnlyAssignment(AssignOp assign) {
  Operation *only = nullptr;
  WalkResult result = assign.walk([&](Operation *op) {
    if (!isa<AssignmentOpInterface>(op))
      return WalkResult::advance();
    if (only)
      return WalkResult::interrupt();
    only = op;
    return WalkResult::advance();
  });
  return result.wasInterrupted() ? nullptr : only;
}

//===----------------------------------------------------------------------===//
// By range
//===----------------------------------------------------------------------===//

/// The field that a coordinate is or is cast from, as a user knows it.
static std::string describeCoordinate(Value coordinate, int64_t dim) {
  for (Operation *op = coordinate.getDefiningOp(); op;
       op = op->getNumOperands() == 1 ? op->getOperand(0).getDefiningOp()
                                      : nullptr)
    if (auto get = dyn_cast<GetOp>(op))
      return ("'" + get.getField() + "'").str();
  return "coordinate " + std::to_string(dim);
}

LogicalResult BinIdentity::proveByRange(EdgeOp edge, AssignToOp to,
                                        Refusal &refusal) {
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  auto cell = to.getBin().getDefiningOp<BinAtOp>();
  if (!cell) {
    refusal = {to, "the bin is not that of a cell, nor is it computed as the "
                   "producer's was; if it always is that bin, promise that by "
                   "assignToPreviousBins"};
    return failure();
  }
  for (EmissionOpInterface emit : getEmits(producer, edge.getPort())) {
    LinearFacts facts(emit, *this);
    unsigned frame = facts.addAssign(to->getParentOfType<AssignOp>(), emit);
    facts.assumeReached(to, frame);
    for (auto [dim, coordinate] : llvm::enumerate(cell.getCoordinates())) {
      bool isAbove = facts.isAboveBin(coordinate, dim, frame);
      if (isAbove && facts.isBelowBin(coordinate, dim, frame))
        continue;
      refusal = {emit, describeCoordinate(coordinate, dim) +
                           " is not proved to be " +
                           (isAbove ? "below the bin's upper bound"
                                    : "at least the bin's lower bound") +
                           " here; if it always is, promise that by "
                           "assignToPreviousBins"};
      return failure();
    }
  }
  return success();
}

bool BinIdentity::isFieldInBin(StageOp stage, StringRef field, int64_t dim) {
  AssignOp assign = stage.getAssign();
  if (!assign || !stage.getProcess() || hasSource(stage) ||
      !isa_and_nonnull<AssignPreviousOp>(getOnlyAssignment(assign)))
    return false;
  auto name = StringAttr::get(stage.getContext(), field);
  // On a cycle nothing is known of it while it is being found out.
  auto [found, isNew] = fields.try_emplace({stage, name, dim}, false);
  if (!isNew)
    return found->second;
  int64_t place =
      getElementIndex(lookupRecord(stage, stage.getInputAttr()), field);
  SmallVector<EdgeOp> edges = getEdgesInto(stage);
  bool isInBin = llvm::all_of(edges, [&](EdgeOp edge) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    return producer.getBins() == stage.getBins() &&
           llvm::all_of(getEmits(producer, edge.getPort()),
                        [&](EmissionOpInterface emit) {
                          LinearFacts facts(emit, *this);
                          Value value = emit.getNumbers()[place];
                          return facts.isAboveBin(value, dim) &&
                                 facts.isBelowBin(value, dim);
                        });
  });
  return fields[{stage, name, dim}] = isInBin && !edges.empty();
}

//===----------------------------------------------------------------------===//
// By function
//===----------------------------------------------------------------------===//

bool BinIdentity::isSameFunction(EdgeOp edge, AssignToOp to) {
  auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
  AssignOp assign = producer.getAssign();
  auto own = dyn_cast_or_null<AssignToOp>(assign ? getOnlyAssignment(assign)
                                                 : nullptr);
  return own &&
         llvm::all_of(
             getEmits(producer, edge.getPort()), [&](EmissionOpInterface emit) {
               LinearFacts facts(emit, *this);
               unsigned emitted =
                   facts.addAssign(to->getParentOfType<AssignOp>(), emit);
               return llvm::any_of(facts.getItems(), [&](Value item) {
                 return facts.isSame(to.getBin(), emitted, own.getBin(),
                                     facts.addAssign(assign, item));
               });
             });
}

//===----------------------------------------------------------------------===//
// Stages
//===----------------------------------------------------------------------===//

LogicalResult BinIdentity::prove(StageOp consumer, Refusal &refusal) {
  auto refuse = [&](Operation *at, const Twine &why) {
    refusal = {at, why.str()};
    return failure();
  };
  AssignOp assign = consumer.getAssign();
  if (!assign)
    return refuse(consumer, "it has no assign phase");
  SmallVector<EdgeOp> edges = getEdgesInto(consumer);
  if (hasSource(consumer) || edges.empty())
    return refuse(consumer, "its primitives come from a source");
  for (EdgeOp edge : edges) {
    auto producer = lookupInPipeline<StageOp>(edge, edge.getProducerAttr());
    if (producer.getBins() != consumer.getBins())
      return refuse(consumer,
                    "its bins are not of the size of those of stage '" +
                        producer.getSymName() + "'");
  }
  Operation *only = getOnlyAssignment(assign);
  if (!only)
    return refuse(assign, "it is assigned in several places");
  auto to = dyn_cast<AssignToOp>(only);
  if (!to)
    return refuse(only, "this may be several bins");
  if (consumer.isWholeDomain() && matchPattern(to.getBin(), m_Zero()))
    return success();
  for (EdgeOp edge : edges)
    if (!isSameFunction(edge, to) && failed(proveByRange(edge, to, refusal)))
      return failure();
  return success();
}
