// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A key is compared by <, <=, > or >=, and where it is equal, by what is
// compared next. Numbers after the first are integers: nothing is before a NaN.
// Of equal keys the last is kept where the last comparison is <= or >=, else
// the first.

#include "Reductions/KeyReader.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"

using namespace mlir;
using namespace piko;

Value piko::getNegated(Value value) {
  auto negation = value.getDefiningOp<arith::XOrIOp>();
  return negation && matchPattern(negation.getRhs(), m_One())
             ? negation.getLhs()
             : Value();
}

static constexpr const char *notAKey =
    "whether the pixel changes is no comparison of its numbers with new ones; "
    "compare what it keeps, as in a < pixel.a || (a == pixel.a && b < pixel.b)";
static constexpr const char *takesNaN =
    "a NaN passes this comparison, too, so that the order shows; write it as "
    "a < pixel.a, not as !(a >= pixel.a)";

bool KeyReader::findSides(Value a, Value b, Test &test, bool &isSwapped) {
  for (auto [old, value, swaps] : {std::tuple{b, a, false}, {a, b, true}}) {
    auto argument = dyn_cast<BlockArgument>(old);
    if (!argument || argument.getOwner() != &body ||
        dependsOnPixel(value, update))
      continue;
    test.number = argument.getArgNumber();
    test.value = value;
    isSwapped = swaps;
    return true;
  }
  return false;
}

std::optional<KeyReader::Test> KeyReader::readTest(arith::CmpIOp compare,
                                                   bool outcome) {
  using P = arith::CmpIPredicate;
  P predicate = compare.getPredicate();
  if (!outcome)
    predicate = arith::invertPredicate(predicate);
  Test test;
  bool isSwapped;
  if (!findSides(compare.getLhs(), compare.getRhs(), test, isSwapped))
    return std::nullopt;
  if (predicate == P::eq || predicate == P::ne) {
    test.kind = predicate == P::eq ? Test::Equal : Test::NotEqual;
    return test;
  }
  bool isStrict =
      llvm::is_contained({P::slt, P::sgt, P::ult, P::ugt}, predicate);
  bool isSigned =
      llvm::is_contained({P::slt, P::sgt, P::sle, P::sge}, predicate);
  bool isLess = llvm::is_contained({P::slt, P::sle, P::ult, P::ule},
                                   predicate) != isSwapped;
  test.kind = isStrict ? Test::Before : Test::NotAfter;
  test.comparison =
      isSigned ? (isLess ? "slt" : "sgt") : (isLess ? "ult" : "ugt");
  return test;
}

/// The comparison that holds where another one does not.
static arith::CmpFPredicate invert(arith::CmpFPredicate predicate) {
  using P = arith::CmpFPredicate;
  switch (predicate) {
  case P::OEQ:
    return P::UNE;
  case P::UNE:
    return P::OEQ;
  case P::UGE:
    return P::OLT;
  case P::UGT:
    return P::OLE;
  case P::ULE:
    return P::OGT;
  case P::ULT:
    return P::OGE;
  default:
    return P::AlwaysTrue; // or what else is no key
  }
}

std::optional<KeyReader::Test> KeyReader::readTest(arith::CmpFOp compare,
                                                   bool outcome) {
  using P = arith::CmpFPredicate;
  P predicate = compare.getPredicate();
  Test test;
  bool isSwapped;
  if (!findSides(compare.getLhs(), compare.getRhs(), test, isSwapped))
    return std::nullopt;
  if (!outcome)
    predicate = invert(predicate);
  if (predicate == P::OEQ || predicate == P::UNE) {
    test.kind = predicate == P::OEQ ? Test::Equal : Test::NotEqual;
    return test;
  }
  if (!llvm::is_contained({P::OLT, P::OLE, P::OGT, P::OGE}, predicate)) {
    why = takesNaN;
    return std::nullopt;
  }
  bool isLess = llvm::is_contained({P::OLT, P::OLE}, predicate) != isSwapped;
  test.kind = llvm::is_contained({P::OLT, P::OGT}, predicate) ? Test::Before
                                                              : Test::NotAfter;
  test.comparison = isLess ? "olt" : "ogt";
  return test;
}

std::optional<KeyReader::Test> KeyReader::readTest(Value condition,
                                                   bool outcome) {
  if (Value negated = getNegated(condition))
    return readTest(negated, !outcome);
  if (auto compare = condition.getDefiningOp<arith::CmpIOp>())
    return readTest(compare, outcome);
  if (auto compare = condition.getDefiningOp<arith::CmpFOp>())
    return readTest(compare, outcome);
  return std::nullopt;
}

bool KeyReader::add(const Test &test) {
  // Where the first number is before, the others are kept as they are.
  if (!values.empty() && isa<FloatType>(test.value.getType()))
    return refuse("a number after the first of a key may be a NaN, before "
                  "which nothing is; let it be an integer");
  if (llvm::is_contained(values, test.value) ||
      llvm::any_of(key.numbers, [&](const KeyNumber &known) {
        return known.number == test.number;
      }))
    return refuse(notAKey);
  key.numbers.push_back({test.number, test.comparison});
  values.push_back(test.value);
  return true;
}

bool KeyReader::readRest(Literal before, Literal isEqual, Literal rest) {
  std::optional<Test> first = readTest(before), equal = readTest(isEqual);
  // Where they are equal the rest decides, whatever the first one says of that.
  if (!first || !equal || equal->kind != Test::Equal ||
      first->kind != Test::Before || first->number != equal->number ||
      first->value != equal->value)
    return refuse(why ? why : notAKey);
  return add(*first) && read(rest);
}

bool KeyReader::split(Literal literal, Literal &test, Literal &yes,
                      Literal &no) {
  auto [value, outcome] = literal;
  for (Value negated; (negated = getNegated(value)); value = negated)
    outcome = !outcome;
  yes = no = {};
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<arith::OrIOp, arith::AndIOp>(op)) {
    test = {op->getOperand(0), outcome};
    bool isOr = isa<arith::OrIOp>(op) == outcome;
    (isOr ? no : yes) = {op->getOperand(1), outcome};
    return true;
  }
  Value then, otherwise;
  if (auto select = dyn_cast_or_null<arith::SelectOp>(op)) {
    test = {select.getCondition(), true};
    then = select.getTrueValue();
    otherwise = select.getFalseValue();
  } else if (auto branch = dyn_cast_or_null<scf::IfOp>(op)) {
    test = {branch.getCondition(), true};
    unsigned result = cast<OpResult>(value).getResultNumber();
    then = branch.thenYield().getOperand(result);
    otherwise = branch.elseYield().getOperand(result);
  } else {
    return false;
  }
  auto side = [&](Value value, bool constant) {
    bool isConstant = constant == outcome ? matchPattern(value, m_One())
                                          : matchPattern(value, m_Zero());
    return isConstant ? Literal{} : Literal{value, outcome};
  };
  yes = side(then, true);
  no = side(otherwise, false);
  return true;
}

/// a || (b && c), and what else means that.
bool KeyReader::readChoice(Literal condition) {
  Literal yes, no, test;
  if (!split(condition, test, yes, no))
    return refuse(notAKey);
  if (yes && no) { // test ? yes : no
    std::optional<Test> known = readTest(test);
    if (known && known->kind == Test::Equal)
      return readRest(no, test, yes);
    if (known && known->kind == Test::NotEqual)
      return readRest(yes, {test.value, !test.outcome}, no);
    return refuse(why ? why : notAKey);
  }
  if (yes) // test && yes
    return readConjunction(test, yes);
  Literal before = test, other = no;
  for (int order = 0; order < 2; ++order, std::swap(before, other)) {
    if (!split(other, test, yes, no) || !yes || no)
      continue;
    std::optional<Test> known = readTest(test);
    return known && known->kind == Test::Equal ? readRest(before, test, yes)
                                               : readRest(before, yes, test);
  }
  return refuse(notAKey);
}

/// a <= b && (a != b || c)
bool KeyReader::readConjunction(Literal first, Literal second) {
  for (int order = 0; order < 2; ++order, std::swap(first, second)) {
    std::optional<Test> bound = readTest(first);
    Literal test, yes, no;
    if (!bound || bound->kind != Test::NotAfter ||
        !split(second, test, yes, no) || yes)
      continue;
    std::optional<Test> known = readTest(test);
    if (!known || known->kind != Test::NotEqual) {
      std::swap(test, no);
      known = readTest(test);
    }
    if (!known || known->kind != Test::NotEqual ||
        known->number != bound->number || known->value != bound->value)
      continue;
    bound->kind = Test::Before;
    return add(*bound) && read(no);
  }
  return refuse(why ? why : notAKey);
}

bool KeyReader::read(Value condition, bool outcome) {
  if (Value negated = getNegated(condition))
    return read(negated, !outcome);
  if (std::optional<Test> test = readTest(condition, outcome)) {
    if (test->kind != Test::Before && test->kind != Test::NotAfter)
      return refuse(notAKey);
    key.last = test->kind == Test::NotAfter;
    return add(*test);
  }
  return !why && readChoice({condition, outcome});
}
