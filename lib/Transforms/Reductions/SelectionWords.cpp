// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Reductions/SelectionWords.h"

#include "Deferral/InternalImage.h"
#include "Piko/Transforms/Storage/PixelAccess.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/PatternMatch.h"

using namespace mlir;
using namespace piko;

static constexpr unsigned wordBits = 64, positionBits = 32;

//===----------------------------------------------------------------------===//
// Words
//===----------------------------------------------------------------------===//

SelectionWords::SelectionWords(const Selection &selection)
    : key(selection.key), keyImage(selection.images.front().name) {
  UpdateOp update = selection.sites.front().update;
  Block &body = update.getBody().front();
  unsigned room = 0;
  auto add = [&](Part part) {
    if (part.width > room) {
      parts.emplace_back();
      room = wordBits;
    }
    parts.back().push_back(part);
    room -= part.width;
  };
  for (const KeyNumber &number : key.numbers)
    add({number,
         body.getArgument(number.number).getType().getIntOrFloatBitWidth()});
  add({std::nullopt, positionBits});
}

void SelectionWords::createImages(PipelineOp pipeline) {
  auto image = cast<ImageOp>(SymbolTable::lookupSymbolIn(pipeline, keyImage));
  Builder builder(pipeline.getContext());
  IntegerType type = builder.getI64Type();
  auto last = builder.getArrayAttr({builder.getIntegerAttr(type, -1)});
  for (int64_t word = 0; word < size(); ++word)
    images.push_back(createInternalImage(image, "first", {Type(type)}, last));
}

/// An integer as wide, which is the smaller one, as unsigned, of what comes
/// first by a comparison.
static Value toUnsigned(OpBuilder &builder, Location loc, Value number,
                        StringRef comparison) {
  unsigned width = number.getType().getIntOrFloatBitWidth();
  Type type = builder.getIntegerType(width);
  auto constant = [&](const APInt &bits) -> Value {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getIntegerAttr(type, bits));
  };
  Value sign = constant(APInt::getSignMask(width));
  if (isa<FloatType>(number.getType())) {
    // A zero is 0.0; what is negative has all bits turned.
    Value zero = arith::ConstantOp::create(
        builder, loc, builder.getZeroAttr(number.getType()));
    number = arith::AddFOp::create(builder, loc, number, zero);
    number = arith::BitcastOp::create(builder, loc, type, number);
    Value isNegative = arith::ShRSIOp::create(
        builder, loc, number, constant(APInt(width, width - 1)));
    sign = arith::OrIOp::create(builder, loc, isNegative, sign);
  }
  if (!comparison.starts_with("u"))
    number = arith::XOrIOp::create(builder, loc, number, sign);
  if (comparison.ends_with("gt"))
    number = arith::XOrIOp::create(builder, loc, number,
                                   constant(APInt::getAllOnes(width)));
  return number;
}

SmallVector<Value> SelectionWords::compute(OpBuilder &builder, UpdateOp update,
                                           ArrayRef<Value> numbers,
                                           Value prim) const {
  Location loc = update.getLoc();
  Type i64 = builder.getI64Type();
  auto constant = [&](int64_t value) -> Value {
    return arith::ConstantIntOp::create(builder, loc, value, wordBits);
  };
  const Value *next = numbers.begin();
  auto getPart = [&](const Part &part) -> Value {
    if (part.number) {
      Value bits = toUnsigned(builder, loc, *next++, part.number->comparison);
      return part.width == wordBits
                 ? bits
                 : arith::ExtUIOp::create(builder, loc, i64, bits);
    }
    Value position = PositionOp::create(builder, loc, prim);
    position = arith::IndexCastUIOp::create(builder, loc, i64, position);
    if (!key.last)
      return position;
    return arith::XOrIOp::create(
        builder, loc, position,
        constant(llvm::maskTrailingOnes<uint64_t>(positionBits)));
  };
  SmallVector<Value> words;
  for (ArrayRef<Part> of : parts) {
    Value word;
    for (const Part &part : of) {
      Value bits = getPart(part);
      if (word) {
        word = arith::ShLIOp::create(builder, loc, word, constant(part.width));
        bits = arith::OrIOp::create(builder, loc, word, bits);
      }
      word = bits;
    }
    words.push_back(word);
  }
  return words;
}

//===----------------------------------------------------------------------===//
// Sites
//===----------------------------------------------------------------------===//

namespace {

/// Makes plain operations of an update that is a site.
class SiteRewriter {
public:
  SiteRewriter(const Selection::Site &site, const SelectionKey &key);
  /// Up to where it says what is kept; `builder` stands there.
  void open();
  /// Gives the results, as if `kept` said whether new numbers are kept.
  void close(Value kept);
  Value getTest(Value isOne, Value more) {
    return isOne ? arith::AndIOp::create(builder, loc, isOne, more) : more;
  }
  /// Whether a word of the pixel is `word`, or after it.
  Value compare(ImageOp image, arith::CmpIPredicate predicate, Value word) {
    return arith::CmpIOp::create(builder, loc, predicate, word,
                                 pixel.loadFrom(builder, image));
  }
  /// A region where that holds.
  OpBuilder when(Value condition) {
    return scf::IfOp::create(builder, loc, condition, /*withElse=*/false)
        .getThenBodyBuilder();
  }
  Value negate(Value value) {
    Value yes =
        arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
    return arith::XOrIOp::create(builder, loc, value, yes);
  }

  UpdateOp update;
  Location loc;
  PixelAccess pixel;
  IRRewriter builder;
  SmallVector<Value> numbers; ///< The key's, new ones if they are kept.
  /// The condition of the site, as it has to be; null = always.
  Value condition;
  /// What is kept: numbers of the record.
  SmallVector<std::pair<unsigned, Value>> kept;

private:
  enum class Result : uint8_t { Kept, NotKept, Other };
  SmallVector<Result> results;
  bool outcome;
  scf::IfOp test;
  YieldOp yield;
};

} // namespace

SiteRewriter::SiteRewriter(const Selection::Site &site, const SelectionKey &key)
    : update(site.update), loc(update.getLoc()), pixel(update), builder(update),
      condition(site.condition), outcome(site.outcome) {
  yield = cast<YieldOp>(update.getBody().front().getTerminator());
  ValueRange old = update.getBody().getArguments();
  for (auto [number, value] : llvm::enumerate(yield.getPixel()))
    if (value != old[number])
      kept.push_back({unsigned(number), value});
  for (const KeyNumber &number : key.numbers)
    numbers.push_back(yield.getPixel()[number.number]);
  for (Value value : yield.getResults()) {
    bool isCondition = condition && dependsOnPixel(value, update);
    results.push_back(!isCondition                      ? Result::Other
                      : (value == condition) == outcome ? Result::Kept
                                                        : Result::NotKept);
  }
}

void SiteRewriter::open() {
  test = pixel.createTest(builder, update.getResultTypes());
  SmallVector<Value> old = pixel.load(builder);
  Block *then = test.thenBlock();
  if (update.getNumResults() == 0)
    builder.setInsertionPoint(then->getTerminator());
  builder.inlineBlockBefore(&update.getBody().front(), then,
                            builder.getInsertionPoint(), old);
  builder.setInsertionPoint(yield);
  if (condition && !outcome)
    condition = negate(condition);
}

void SiteRewriter::close(Value isKept) {
  builder.setInsertionPoint(yield);
  SmallVector<Value> values(yield.getResults());
  for (auto [value, kind] : llvm::zip(values, results))
    if (kind != Result::Other)
      value = kind == Result::Kept ? isKept : negate(isKept);
  if (!values.empty())
    scf::YieldOp::create(builder, loc, values);
  builder.eraseOp(yield);
  builder.replaceOp(update, test);
}

/// The primitive that an update is made for.
static Value getPrim(UpdateOp update) {
  return update->getParentOfType<ItemsOp>().getPrim();
}

void SelectionWords::reduce(const Selection::Site &site, int64_t pass) const {
  using P = arith::CmpIPredicate;
  SiteRewriter rewriter(site, key);
  rewriter.open();
  OpBuilder &builder = rewriter.builder;
  SmallVector<Value> words =
      compute(builder, rewriter.update, rewriter.numbers, getPrim(site.update));
  Value isOne = rewriter.condition;
  for (int64_t before = 0; before < pass; ++before)
    isOne = rewriter.getTest(
        isOne, rewriter.compare(images[before], P::eq, words[before]));
  // Most are after what is there already: a load is less than a change.
  isOne = rewriter.getTest(isOne,
                           rewriter.compare(images[pass], P::ult, words[pass]));
  OpBuilder inside = rewriter.when(isOne);
  rewriter.pixel.changeIn(inside, images[pass], AtomicKind::MinU, words[pass]);
  Value none = arith::ConstantOp::create(builder, rewriter.loc,
                                         builder.getBoolAttr(false));
  rewriter.close(none);
}

void SelectionWords::resolve(const Selection::Site &site) const {
  SiteRewriter rewriter(site, key);
  rewriter.open();
  OpBuilder &builder = rewriter.builder;
  SmallVector<Value> words =
      compute(builder, rewriter.update, rewriter.numbers, getPrim(site.update));
  // The condition once more: of equal ones of a primitive the first is kept.
  Value isFirst = rewriter.condition;
  for (auto [image, word] : llvm::zip(images, words))
    isFirst = rewriter.getTest(
        isFirst, rewriter.compare(image, arith::CmpIPredicate::eq, word));
  OpBuilder inside = rewriter.when(isFirst);
  for (auto [number, value] : rewriter.kept)
    rewriter.pixel.store(inside, number, value);
  rewriter.close(isFirst);
}

void SelectionWords::resolveCarried(UpdateOp update) {
  SiteRewriter rewriter({update, Value()}, SelectionKey());
  rewriter.open();
  for (auto [number, value] : rewriter.kept)
    rewriter.pixel.store(rewriter.builder, number, value);
  rewriter.close(Value());
}
