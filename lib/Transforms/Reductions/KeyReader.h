// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Conditions on which an update keeps new numbers, as comparisons of keys.

#ifndef PIKO_LIB_TRANSFORMS_KEYREADER_H
#define PIKO_LIB_TRANSFORMS_KEYREADER_H

#include "Reductions/PixelSelection.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

namespace piko {

/// The negated value, if it is one.
mlir::Value getNegated(mlir::Value value);

/// Reads a condition on which new numbers are kept as a comparison of keys,
/// number by number.
class KeyReader {
public:
  explicit KeyReader(UpdateOp update)
      : update(update), body(update.getBody().front()) {}
  /// False if there is a reason why it is none.
  bool read(mlir::Value condition, bool outcome);

  SelectionKey key;
  llvm::SmallVector<mlir::Value> values; ///< The new numbers, as the key's.
  const char *why = nullptr;

private:
  /// A comparison of two numbers.
  struct Test {
    enum Kind : uint8_t { Before, NotAfter, Equal, NotEqual } kind;
    unsigned number;
    mlir::Value value;
    llvm::StringRef
        comparison; ///< Where new is before old, if it is no equality.
  };
  bool refuse(const char *reason) {
    why = reason;
    return false;
  }
  std::optional<Test> readTest(mlir::Value condition, bool outcome);
  std::optional<Test> readTest(mlir::arith::CmpIOp compare, bool outcome);
  std::optional<Test> readTest(mlir::arith::CmpFOp compare, bool outcome);
  /// Which of them is the pixel's.
  bool findSides(mlir::Value a, mlir::Value b, Test &test, bool &isSwapped);
  bool add(const Test &test);
  /// A condition, or its opposite.
  struct Literal {
    mlir::Value value;
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
  mlir::Block &body;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_KEYREADER_H
