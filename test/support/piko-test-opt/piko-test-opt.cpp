// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-opt with a dialect of tests, whose operations stand in phases.

#include "Piko/Dialect/Piko/IR/Piko.h"
#include "Piko/Driver/DeepStack.h"
#include "Piko/Driver/Registration.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/DialectImplementation.h"
#include "mlir/Tools/mlir-opt/MlirOptMain.h"

#include "TestDialect.h.inc"

#define GET_OP_CLASSES
#include "TestOps.h.inc"

#include "TestDialect.cpp.inc"

#define GET_OP_CLASSES
#include "TestOps.cpp.inc"

using namespace mlir;
using namespace piko;
using namespace piko::test;

void TestDialect::initialize() {
  addOperations<
#define GET_OP_LIST
#include "TestOps.cpp.inc"
      >();
}

void AssignPairOp::buildBins(OpBuilder &builder, Operation *, Value,
                             PutInBin put) {
  Value a = getA(), b = getB();
  put(builder, arith::MinSIOp::create(builder, getLoc(), a, b));
  put(builder, arith::MaxSIOp::create(builder, getLoc(), a, b));
}

void StayOp::buildBins(OpBuilder &builder, Operation *, Value previous,
                       PutInBin put) {
  put(builder, previous);
}
bool StayOp::keepsBin() { return true; }
bool StayOp::canFail() { return false; }

FlatSymbolRefAttr ScribbleOp::getAccessedState() { return getStateAttr(); }
int ScribbleOp::getAccessKinds() { return StateAccess::stores; }

Value EachOp::buildIteration(OpBuilder &) { return getBody().getArgument(0); }

FlatSymbolRefAttr SmearOp::getAccessedState() { return getStateAttr(); }
int SmearOp::getAccessKinds() { return StateAccess::updates; }

FlatSymbolRefAttr PeekOp::getAccessedState() { return getStateAttr(); }
int PeekOp::getAccessKinds() { return StateAccess::reads; }

int main(int argc, char **argv) {
  DialectRegistry registry;
  registerPikoDialects(registry);
  registry.insert<TestDialect>();
  registerPikoPasses();
  return runMainOnDeepStack([&] {
    return asMainReturnCode(MlirOptMain(
        argc, argv, "piko-opt with a dialect of tests\n", registry));
  });
}
