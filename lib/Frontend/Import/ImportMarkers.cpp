//===- ImportMarkers.cpp - Lists, bins and directives ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Import/PhaseImporter.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"

using namespace piko;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

LogicalResult PhaseImporter::importMarker(llvm::CallInst *call,
                                          const Marker &marker) {
  switch (marker.kind) {
  case MarkerKind::state:
  case MarkerKind::input:
  case MarkerKind::element:
  case MarkerKind::phase:
  case MarkerKind::loopFirst:
  case MarkerKind::loopNext:
  case MarkerKind::cellsOf:
  case MarkerKind::floatPosition:
    return success();
  case MarkerKind::loopMore:
    if (loops.getByHeader(call->getParent()))
      return success();
    return reject(call, "a parallelFor whose iterations never end");
  case MarkerKind::cellAt:
    return importCellAt(call);
  case MarkerKind::listSize:
  case MarkerKind::listAt:
  case MarkerKind::extent:
  case MarkerKind::imageExtent:
  case MarkerKind::bin:
  case MarkerKind::binAt:
  case MarkerKind::binLo:
  case MarkerKind::binHi:
  case MarkerKind::domain:
    return importQuery(call, marker);
  case MarkerKind::allowsUlps:
    values[call] =
        make<AllowsUlpsOp>(builder.getI1Type(), getConstant(call, 0));
    return success();
  case MarkerKind::sync:
    if (failed(checkBarrier(call, "sync")))
      return failure();
    make<SyncOp>();
    return success();
  case MarkerKind::sort:
    return importSort(call, marker.isSigned);
  default:
    return importDirective(call, marker);
  }
}

LogicalResult PhaseImporter::importQuery(llvm::CallInst *call,
                                         const Marker &marker) {
  mlir::Type index = builder.getIndexType();
  switch (marker.kind) {
  case MarkerKind::listSize:
    return setIndex(call, make<ListSizeOp>(entry->getArgument(0)));
  case MarkerKind::listAt: {
    auto list = llvm::cast<ListType>(entry->getArgument(0).getType());
    values[call] = make<ListAtOp>(PrimType::get(&context, list.getRecord()),
                                  /*checked=*/false, entry->getArgument(0),
                                  getIndex(call, 0));
    return success();
  }
  case MarkerKind::extent:
  case MarkerKind::imageExtent: {
    const StateDescription *state = getState(call, call->getArgOperand(0));
    if (!state)
      return failure();
    return setIndex(call,
                    make<ExtentOp>(index, state->name, getConstant(call, 1)));
  }
  case MarkerKind::bin:
    if (phase == WrapperKind::Schedule)
      return setIndex(call, entry->getArgument(0));
    return setIndex(call, make<BinOp>(index));
  case MarkerKind::binAt:
    return setIndex(
        call, make<BinAtOp>(index, getCoordinates(call->args(), getRank())));
  case MarkerKind::binLo:
    return setIndex(
        call, make<BinLoOp>(index, getIndex(call, 0), getConstant(call, 1)));
  case MarkerKind::binHi:
    return setIndex(
        call, make<BinHiOp>(index, getIndex(call, 0), getConstant(call, 1)));
  default:
    return setIndex(call, make<DomainOp>(index, getConstant(call, 0)));
  }
}

LogicalResult PhaseImporter::importDirective(llvm::CallInst *call,
                                             const Marker &marker) {
  if (phase == WrapperKind::Schedule)
    return importScheduleDirective(call, marker);
  bool isAssign = phase == WrapperKind::Assign;
  if (const Assignment *assignment = getAssignment(marker.kind);
      assignment && isAssign)
    return importAssignment(call, *assignment);
  return fail(call) << "expected directives in the phase they are for, but "
                       "stage '"
                    << stage.name << "' has one in its "
                    << (isAssign ? "assignBin" : "process") << " phase";
}

LogicalResult PhaseImporter::importAssignment(llvm::CallInst *call,
                                              const Assignment &assignment) {
  mlir::OperationState state(*location, assignment.operation);
  if (assignment.operands == Assignment::Bin)
    state.addOperands(getIndex(call, 0));
  if (assignment.operands == Assignment::TwoPoints) {
    auto rank = static_cast<int32_t>(getRank());
    for (unsigned first : {0, 4})
      state.addOperands(
          getCoordinates(llvm::drop_begin(call->args(), first), rank));
    state.addAttribute("operandSegmentSizes",
                       builder.getDenseI32ArrayAttr({rank, rank}));
  }
  builder.create(state);
  return success();
}

/// Those that are the same for all bins are read by readDirectives.
LogicalResult PhaseImporter::importScheduleDirective(llvm::CallInst *call,
                                                     const Marker &marker) {
  const Directive *directive = getDirective(marker.kind);
  if (!directive || directive->varies == Directive::Stage)
    return success();
  mlir::OperationState state(*location, directive->getOperation());
  for (llvm::Value *operand : call->args())
    state.addOperands(scalars.get(operand));
  builder.create(state);
  return success();
}
