// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PixelSelection.h"

#include "SplitUpdate.h"
#include "StateAccess.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

bool piko::dependsOnPixel(Value value, UpdateOp update) {
  llvm::SetVector<Value> reached;
  reached.insert(value);
  for (size_t i = 0; i < reached.size(); ++i) {
    Value used = reached[i];
    if (!update.getBody().isAncestor(used.getParentRegion()))
      continue;
    Operation *op = used.getDefiningOp();
    if (!op) // of the update, or of a loop in it
      return true;
    getUsedValuesDefinedAbove(op->getRegions(), reached);
    reached.insert(op->operand_begin(), op->operand_end());
  }
  return false;
}

/// The negated value, if it is one.
static Value getNegated(Value value) {
  auto negation = value.getDefiningOp<arith::XOrIOp>();
  return negation && matchPattern(negation.getRhs(), m_One())
             ? negation.getLhs()
             : Value();
}

//===----------------------------------------------------------------------===//
// Keys
//===----------------------------------------------------------------------===//

namespace {

/// Reads a condition on which new numbers are kept as a comparison of keys,
/// number by number.
class KeyReader {
public:
  explicit KeyReader(UpdateOp update)
      : update(update), body(update.getBody().front()) {}
  /// False if there is a reason why it is none.
  bool read(Value condition, bool outcome);

  SelectionKey key;
  SmallVector<Value> values; ///< The new numbers, as the key's.
  const char *why = nullptr;

private:
  /// A comparison of two numbers.
  struct Test {
    enum Kind : uint8_t { Before, NotBehind, Equal, NotEqual } kind;
    unsigned number;
    Value value;
    StringRef comparison; ///< Where new is before old, if it is no equality.
  };
  bool refuse(const char *reason) {
    why = reason;
    return false;
  }
  std::optional<Test> readTest(Value condition, bool outcome);
  std::optional<Test> readTest(arith::CmpIOp compare, bool outcome);
  std::optional<Test> readTest(arith::CmpFOp compare, bool outcome);
  /// Which of them is the pixel's.
  bool findSides(Value a, Value b, Test &test, bool &isSwapped);
  bool add(const Test &test);
  /// A condition, or its opposite.
  struct Literal {
    Value value;
    bool outcome;
    explicit operator bool() const { return bool(value); }
  };
  bool read(Literal literal) { return read(literal.value, literal.outcome); }
  std::optional<Test> readTest(Literal literal) {
    return readTest(literal.value, literal.outcome);
  }
  /// What it is as test ? yes : no, where null stands for true, or for false.
  static bool split(Literal literal, Literal &test, Literal &yes, Literal &no);
  /// `before`, or equal numbers and `rest`.
  bool readRest(Literal before, Literal isEqual, Literal rest);
  bool readChoice(Literal condition);
  bool readConjunction(Literal first, Literal second);

  UpdateOp update;
  Block &body;
};

constexpr const char *notAKey =
    "whether the pixel changes is no comparison of its numbers with new ones; "
    "compare what it keeps, as in a < pixel.a || (a == pixel.a && b < pixel.b)";
constexpr const char *takesNaN =
    "a NaN passes this comparison, too, so that the order shows; write it as "
    "a < pixel.a, not as !(a >= pixel.a)";

} // namespace

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
  test.kind = isStrict ? Test::Before : Test::NotBehind;
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
                                                              : Test::NotBehind;
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
    return refuse("a number behind the first of a key may be a NaN, before "
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
    if (!bound || bound->kind != Test::NotBehind ||
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
    if (test->kind != Test::Before && test->kind != Test::NotBehind)
      return refuse(notAKey);
    key.last = test->kind == Test::NotBehind;
    return add(*test);
  }
  return !why && readChoice({condition, outcome});
}

//===----------------------------------------------------------------------===//
// Updates
//===----------------------------------------------------------------------===//

/// Whether a choice is on a site's condition, if that is one.
static bool isSame(const Choice &choice, const Selection::Site &site) {
  if (choice.condition == site.condition)
    return choice.outcome == site.outcome;
  auto getCompare = [](Value value) {
    return value ? value.getDefiningOp<arith::CmpIOp>() : arith::CmpIOp();
  };
  arith::CmpIOp a = getCompare(choice.condition),
                b = getCompare(site.condition);
  return a && b && choice.outcome != site.outcome && a.getLhs() == b.getLhs() &&
         a.getRhs() == b.getRhs() &&
         a.getPredicate() == arith::invertPredicate(b.getPredicate());
}

/// Finds which numbers a site keeps, on which condition; a reason if it is not
/// one for all, or they depend on the pixel.
static const char *readSite(Selection::Site &site, Selection::Image &image,
                            SmallVectorImpl<Value> &values) {
  UpdateOp update = site.update;
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  image.name = update.getImageAttr().getAttr();
  for (auto [number, old] : llvm::enumerate(body.getArguments())) {
    Value value = yield.getPixel()[number];
    if (value == old)
      continue;
    Choice choice{Value(), true, value};
    if (std::optional<Choice> found = getChoice(value, old))
      choice = *found;
    if (dependsOnPixel(choice.value, update))
      return "the pixel becomes something that depends on what it was";
    if (image.kept.empty()) {
      site.condition = choice.condition;
      site.outcome = choice.outcome;
    } else if (!isSame(choice, site)) {
      return "not all numbers of the pixel change together";
    }
    image.kept.push_back(number);
    values.push_back(choice.value);
  }
  return nullptr;
}

/// Whether each number of the key is kept as it was compared.
static bool keepsKey(const KeyReader &reader, const Selection::Image &image,
                     ArrayRef<Value> values) {
  for (auto [number, value] : llvm::zip(reader.key.numbers, reader.values)) {
    const int64_t *kept = llvm::find(image.kept, int64_t(number.number));
    if (kept == image.kept.end() || values[kept - image.kept.begin()] != value)
      return false;
  }
  return true;
}

bool SelectionFinder::refuse(Operation *at, const char *why) {
  reason = Reason{at->getLoc(), why};
  return false;
}

bool SelectionFinder::addSite(UpdateOp update) {
  Selection selection;
  Selection::Site site{update, Value()};
  SmallVector<Value> values;
  if (const char *why = readSite(site, selection.images.emplace_back(), values))
    return refuse(update, why);
  if (selection.images.front().kept.empty())
    return refuse(update, "this reads the pixel");
  for (Operation &op : update.getBody().front())
    for (Region &region : op.getRegions())
      if (!visitBranch(region, /*carried=*/nullptr))
        return false;
  // What overwrites it anyway is the last.
  selection.key.last = true;
  if (site.condition && dependsOnPixel(site.condition, update)) {
    KeyReader reader(update);
    if (!reader.read(site.condition, site.outcome))
      return refuse(update, reader.why);
    if (!keepsKey(reader, selection.images.front(), values))
      return refuse(update, "the pixel keeps something else than what is "
                            "compared with it");
    selection.key = reader.key;
  }
  selection.sites.push_back(site);
  return findCarried(selection) && merge(selection);
}

bool SelectionFinder::merge(const Selection &selection) {
  for (Selection &known : selections) {
    if (known.images.front().name != selection.images.front().name)
      continue;
    if (known.key != selection.key || known.images != selection.images)
      return refuse(selection.sites.front().update,
                    "another update selects pixels of this image by another "
                    "key, or keeps other numbers");
    llvm::append_range(known.sites, selection.sites);
    llvm::append_range(known.carried, selection.carried);
    return true;
  }
  selections.push_back(selection);
  return true;
}

//===----------------------------------------------------------------------===//
// What depends on being first so far
//===----------------------------------------------------------------------===//

/// Whether an operation may be done for what is not first in the end: it only
/// computes, and cannot fail.
bool SelectionFinder::isFree(Operation *op, Region &region) const {
  if (auto load = dyn_cast<LoadOp>(op))
    return (load.getChecked() || load.getIndices().empty()) &&
           !names.contains(load.getStateAttr().getAttr());
  if (isa<scf::IfOp, scf::IndexSwitchOp, scf::ForOp, scf::WhileOp,
          memref::LoadOp>(op))
    return true;
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return llvm::all_of(store.getMemref().getUsers(), [&](Operation *user) {
      return region.isAncestor(user->getParentRegion());
    });
  return isa<memref::AllocaOp>(op) ||
         (op->getNumRegions() == 0 && !isa<DivideOp>(op) &&
          isMemoryEffectFree(op));
}

/// Where an update has kept new numbers so far, if `carried` is given, or where
/// it has not.
bool SelectionFinder::visitBranch(Region &region,
                                  SmallVectorImpl<UpdateOp> *carried) {
  return !region
              .walk<WalkOrder::PreOrder>([&](Operation *op) {
                auto update = dyn_cast<UpdateOp>(op);
                if (update && carried && update->getParentRegion() == &region) {
                  carried->push_back(update);
                  return WalkResult::skip();
                }
                if (update ? refuse(op, "whether this pixel changes depends on "
                                        "more than on the first test")
                           : isFree(op, region) ||
                                 refuse(op, "this may fail, or shows, where "
                                            "something else is first in the "
                                            "end"))
                  return WalkResult::advance();
                return WalkResult::interrupt();
              })
              .wasInterrupted();
}

bool SelectionFinder::visitUses(Value isKept, bool outcome,
                                SmallVectorImpl<UpdateOp> &carried) {
  for (Operation *user : isKept.getUsers()) {
    if (isa<arith::XOrIOp>(user) && getNegated(user->getResult(0)) == isKept) {
      if (!visitUses(user->getResult(0), !outcome, carried))
        return false;
      continue;
    }
    auto branch = dyn_cast<scf::IfOp>(user);
    if (!branch || !branch.use_empty())
      return refuse(user, "this depends on what was first so far");
    if (!visitBranch(branch.getThenRegion(), outcome ? &carried : nullptr) ||
        !visitBranch(branch.getElseRegion(), outcome ? nullptr : &carried))
      return false;
  }
  return true;
}

/// Adds numbers of an image; false if some are there.
static bool addKept(Selection &selection, const Selection::Image &image) {
  for (Selection::Image &known : selection.images) {
    if (known.name != image.name)
      continue;
    llvm::append_range(known.kept, image.kept);
    llvm::sort(known.kept);
    return std::adjacent_find(known.kept.begin(), known.kept.end()) ==
           known.kept.end();
  }
  selection.images.push_back(image);
  return true;
}

bool SelectionFinder::findCarried(Selection &selection) {
  const Selection::Site &site = selection.sites.front();
  UpdateOp update = site.update;
  auto yield = cast<YieldOp>(update.getBody().front().getTerminator());
  SmallVector<UpdateOp> carried;
  for (auto [result, value] :
       llvm::zip(update.getResults(), yield.getResults())) {
    if (result.use_empty() || !dependsOnPixel(value, update))
      continue;
    if (!site.condition ||
        (value != site.condition && getNegated(value) != site.condition))
      return refuse(update, "what the pixel was is used elsewhere");
    bool outcome = (value == site.condition) == site.outcome;
    if (!visitUses(result, outcome, carried))
      return false;
  }
  for (UpdateOp other : carried) {
    Selection::Site painted{other, Value()};
    Selection::Image image;
    SmallVector<Value> values;
    if (const char *why = readSite(painted, image, values))
      return refuse(other, why);
    if (painted.condition ||
        !llvm::all_of(other.getResults(),
                      [](Value result) { return result.use_empty(); }))
      return refuse(other, "this reads the pixel");
    if (!llvm::equal(other.getCoordinates(), update.getCoordinates()))
      return refuse(other, "this may be another pixel than the one tested");
    if (!addKept(selection, image))
      return refuse(other, "this number is updated twice");
    behind.insert(other);
    selection.carried.push_back(other);
  }
  // The same for each site.
  llvm::sort(MutableArrayRef(selection.images).drop_front(),
             [](const Selection::Image &a, const Selection::Image &b) {
               return a.name.getValue() < b.name.getValue();
             });
  return true;
}

//===----------------------------------------------------------------------===//
// The kernel
//===----------------------------------------------------------------------===//

/// Whether nothing else uses the images. Whatever else there is may be changed
/// by concurrent calls.
bool SelectionFinder::checkOthers() {
  return !kernel
              .walk([&](Operation *op) {
                const char *why = nullptr;
                StringAttr state;
                if (FlatSymbolRefAttr accessed = getStateAccess(op).first)
                  state = accessed.getAttr();
                if (isa<CheckCallOp>(op))
                  why = "checking mode runs each bin on one thread";
                else if (isa<LocalBinOp>(op))
                  why = "another stage runs when the bin is finished";
                else if (state && names.contains(state) && !isa<UpdateOp>(op))
                  why = "this uses an image that is updated, too";
                if (!why)
                  return WalkResult::advance();
                refuse(op, why);
                return WalkResult::interrupt();
              })
              .wasInterrupted();
}

bool piko::hasOneOrderedBin(StageOp stage) {
  return llvm::all_of(stage.getBins(),
                      [](int64_t extent) { return extent == 0; }) &&
         stage.getOrdered() && !stage.getTile() && !stage.getTakesList();
}

bool SelectionFinder::find() {
  kernel.walk([&](UpdateOp update) {
    StringAttr image = update.getImageAttr().getAttr();
    names.insert(image);
    if (!others.contains(image))
      updates.push_back(update);
  });
  if (!checkOthers())
    return false;
  for (UpdateOp update : updates)
    if (!behind.contains(update) && !addSite(update))
      return false;
  llvm::DenseSet<StringAttr> known;
  for (const Selection &selection : selections)
    for (const Selection::Image &image : selection.images)
      if (!known.insert(image.name).second)
        return refuse(selection.sites.front().update,
                      "an image that changes here changes elsewhere without "
                      "this test");
  return true;
}
