// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Analysis/PhaseGraph.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

SmallVector<EdgeOp> piko::getEdgesInto(StageOp stage) {
  return llvm::to_vector(llvm::make_filter_range(
      getPipeline(stage).getOps<EdgeOp>(),
      [&](EdgeOp edge) { return edge.getConsumer() == stage.getSymName(); }));
}

SmallVector<EdgeOp> piko::getEdgesFrom(StageOp stage) {
  return llvm::to_vector(llvm::make_filter_range(
      getPipeline(stage).getOps<EdgeOp>(),
      [&](EdgeOp edge) { return edge.getProducer() == stage.getSymName(); }));
}

bool piko::hasSource(StageOp stage) {
  return llvm::any_of(
      getPipeline(stage).getOps<SourceOp>(),
      [&](SourceOp source) { return source.getStage() == stage.getSymName(); });
}

SmallVector<EmitOp> piko::getEmits(StageOp stage, int64_t port) {
  SmallVector<EmitOp> emits;
  stage.walk([&](EmitOp emit) {
    if (int64_t(emit.getPort()) == port)
      emits.push_back(emit);
  });
  return emits;
}

int64_t piko::getElementIndex(RecordOp record, StringRef name) {
  int64_t place = 0;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    if (field.getName() == name)
      return place;
    place += field.getElementCount();
  }
  llvm_unreachable("the verifier knows the field");
}

void piko::noteOrigin(Operation *op, StageOp stage, bool inAssign) {
  auto name = StringAttr::get(stage.getContext(), getCppName(stage));
  llvm::TypeSwitch<Operation *>(op)
      .Case<LoadOp>([&](LoadOp load) {
        // Reading a constant does not fail.
        if (load.getOf() || load.getIndices().empty())
          return;
        load.setOfAttr(name);
        load.setAssign(inAssign);
      })
      .Case<DivideOp>([&](DivideOp divide) {
        if (divide.getOf())
          return;
        divide.setOfAttr(name);
        divide.setAssign(inAssign);
      })
      .Case<StoreOp, AtomicOp, UpdateOp>([&](auto access) {
        if (!access.getOf())
          access.setOfAttr(name);
      });
}
