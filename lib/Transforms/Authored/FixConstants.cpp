// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-fix-constants, for each value that is given:
//   1. find the field of a constant, or the buffer whose size it is, and read
//      the value as its type has it;
//   2. say so to the runtime (piko.fixed), which tests it before each run;
//   3. put it in the place of what loads it.

#include "Piko/Transforms/Passes.h"

#include "Piko/Dialect/Piko/IR/PikoFixed.h"

#include "mlir/IR/Matchers.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/Support/Error.h"

namespace piko {
#define GEN_PASS_DEF_FIXCONSTANTS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FixConstantsPass : piko::impl::FixConstantsBase<FixConstantsPass> {
  using FixConstantsBase::FixConstantsBase;
  void runOnOperation() override;

private:
  LogicalResult fix(StringRef text);
  LogicalResult fixSize(BufferOp buffer, StringRef value);
  LogicalResult fixField(ConstantOp constant, StringRef path, StringRef value);
  void declare(Operation *state, StringAttr field, IntegerAttr element,
               TypedAttr value);
  llvm::StringSet<> paths; ///< That are fixed.
  InFlightDiagnostic fail() {
    return getOperation().emitError("piko-fix-constants: ");
  }
};

/// A field of a record and one of its elements.
struct FieldPath {
  StringRef field;
  std::optional<int64_t> element;
};

} // namespace

/// What stands between the brackets at the end, if there are some.
static FieldPath parsePath(StringRef path) {
  auto [field, rest] = path.rsplit('[');
  int64_t element = 0;
  if (rest.consume_back("]") && !rest.getAsInteger(10, element))
    return {field, element};
  return {path, std::nullopt};
}

/// The number as the type has it; null if it is none of it.
static TypedAttr parseNumber(Type type, StringRef text) {
  Builder builder(type.getContext());
  if (auto floats = dyn_cast<FloatType>(type)) {
    APFloat value(floats.getFloatSemantics());
    auto status = value.convertFromString(text, APFloat::rmNearestTiesToEven);
    if (!status) {
      llvm::consumeError(status.takeError());
      return {};
    }
    if (*status & APFloat::opOverflow)
      return {};
    return builder.getFloatAttr(type, value);
  }
  unsigned bits = type.getIntOrFloatBitWidth();
  bool isNegative = text.consume_front("-");
  APInt magnitude;
  if (text.getAsInteger(10, magnitude) || magnitude.getActiveBits() > bits)
    return {};
  APInt value = magnitude.zextOrTrunc(bits);
  if (isNegative) {
    value.negate();
    if (!magnitude.isZero() && !value.isNegative())
      return {};
  }
  return builder.getIntegerAttr(type, value);
}

void FixConstantsPass::declare(Operation *state, StringAttr field,
                               IntegerAttr element, TypedAttr value) {
  OpBuilder builder(state);
  builder.setInsertionPointAfter(state);
  FixedOp::create(builder, state->getLoc(),
                  FlatSymbolRefAttr::get(SymbolTable::getSymbolName(state)),
                  field, element, value);
}

LogicalResult FixConstantsPass::fixSize(BufferOp buffer, StringRef value) {
  int64_t size = 0;
  if (value.getAsInteger(10, size) || size < 0)
    return fail() << "expected how many elements buffer '"
                  << buffer.getSymName() << "' has, but got '" << value << "'";
  OpBuilder builder(&getContext());
  declare(buffer, {}, {}, builder.getIndexAttr(size));
  getOperation().walk([&](ExtentOp extent) {
    if (extent.getState() != buffer.getSymName())
      return;
    builder.setInsertionPoint(extent);
    extent.replaceAllUsesWith(
        arith::ConstantIndexOp::create(builder, extent.getLoc(), size)
            .getResult());
    extent.erase();
  });
  return success();
}

/// Whether a load is of that element, as far as is known.
static bool isOf(LoadOp load, FieldAttr field, int64_t element) {
  int64_t number = 0;
  for (auto [count, index] : llvm::zip(field.getCounts(), load.getElements())) {
    APInt known;
    if (!matchPattern(index, m_ConstantInt(&known)))
      return false;
    number = number * count + known.getSExtValue();
  }
  return number == element;
}

/// Whether an index follows from a number: where it is outside, an error of the
/// run says so, and not one of the compiler's verifiers.
static bool isInIndex(Value number) {
  llvm::SetVector<Value> reached;
  reached.insert(number);
  for (size_t i = 0; i < reached.size(); ++i)
    for (OpOperand &use : reached[i].getUses()) {
      Operation *user = use.getOwner();
      auto store = dyn_cast<StoreOp>(user);
      if (store && use.get() == store.getValue())
        continue;
      if (isa<arith::ArithDialect>(user->getDialect()))
        for (Value result : user->getResults())
          if (result.getType().isIntOrIndex())
            reached.insert(result);
      if (isa<StateAccessOpInterface, GetOp>(user) ||
          isa<memref::MemRefDialect>(user->getDialect()))
        return true;
    }
  return false;
}

LogicalResult FixConstantsPass::fixField(ConstantOp constant, StringRef path,
                                         StringRef value) {
  auto [name, element] = parsePath(path.empty() ? "value" : path);
  FieldAttr field =
      lookupRecord(constant, getStateRecord(constant)).getField(name);
  if (!field)
    return fail() << "expected a field of constant '" << constant.getSymName()
                  << "', but got '" << name << "', which is none";
  if (element.has_value() == field.getCounts().empty() ||
      element.value_or(0) < 0 || element.value_or(0) >= field.getElementCount())
    return fail() << "expected "
                  << (field.getCounts().empty() ? "no element"
                                                : "an element that there is")
                  << " of field '" << name << "', but got '" << path << "'";
  TypedAttr number = parseNumber(field.getType(), value);
  if (!number)
    return fail() << "expected a value of " << field.getType() << " for '"
                  << constant.getSymName() << (path.empty() ? "" : ".") << path
                  << "', but got '" << value << "'";
  Builder builder(&getContext());
  declare(constant, builder.getStringAttr(name),
          element ? builder.getI64IntegerAttr(*element) : IntegerAttr(),
          number);
  getOperation().walk([&](LoadOp load) {
    if (load.getState() != constant.getSymName() || load.getField() != name ||
        !isOf(load, field, element.value_or(0)) || isInIndex(load.getResult()))
      return;
    OpBuilder at(load);
    load.replaceAllUsesWith(
        arith::ConstantOp::create(at, load.getLoc(), number).getResult());
    load.erase();
  });
  return success();
}

LogicalResult FixConstantsPass::fix(StringRef text) {
  auto [path, value] = text.split('=');
  if (!paths.insert(path).second)
    return fail() << "expected one value of '" << path << "', but got two";
  auto [name, field] = path.split('.');
  if (name.empty() || value.empty())
    return fail() << "expected CONSTANT[.FIELD]=VALUE or BUFFER.size=COUNT, "
                     "but got '"
                  << text << "'";
  Operation *state = SymbolTable::lookupSymbolIn(getOperation(), name);
  if (auto constant = dyn_cast_or_null<ConstantOp>(state))
    return fixField(constant, field, value);
  if (auto buffer = dyn_cast_or_null<BufferOp>(state);
      buffer && field == "size")
    return fixSize(buffer, value);
  return fail() << "expected a constant, or .size of a buffer, but got '"
                << path << "'";
}

void FixConstantsPass::runOnOperation() {
  paths.clear();
  for (const std::string &value : values)
    if (failed(fix(value)))
      return signalPassFailure();
}
