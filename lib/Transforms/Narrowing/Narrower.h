// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// 64-bit affine functions of a pixel in 32 bits: what of a loop over pixels
// takes their signs and values, tests before it of what fits, and the
// versions of it for those that do.

#ifndef PIKO_LIB_TRANSFORMS_NARROWER_H
#define PIKO_LIB_TRANSFORMS_NARROWER_H

#include "Narrowing/AffineNest.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"

#include <optional>

namespace piko {

/// The comparisons and conversions of a loop over pixels.
class Narrower {
public:
  /// With strips of so many columns, or none if 0.
  Narrower(mlir::scf::ForOp row, int64_t stripWidth)
      : nest(row), stripWidth(stripWidth) {}

  /// Makes further versions of the loops, as far as there is a use.
  void narrow();

  /// Of 64 bits.
  int64_t comparisons() const {
    return llvm::count_if(tests, [](SignTest test) {
      return test.compare.getLhs().getType().isInteger(64);
    });
  }
  int64_t values() const { return conversions.size(); }
  bool areInterchanged() const { return !required.empty(); }

private:
  /// A function of the pixel whose sign or value matters, as a difference if
  /// there is a second one.
  struct Leaf {
    mlir::Value plus, minus;

    bool operator==(const Leaf &) const = default;
  };

  /// A comparison that is the sign of a tree of leaves: of one leaf, if it is a
  /// difference, or of bits and of minima and maxima of several.
  struct SignTest {
    mlir::arith::CmpIOp compare;
    bool isNegative = false; ///< Or it holds where the sign is clear.
    mlir::Value tree;        ///< null if the leaf is a difference
    Leaf leaf;
  };

  /// What a leaf is in 32 bits, without the bits below its steps.
  struct Narrow {
    Leaf leaf;
    Affine whole;            ///< with these bits
    Affine shifted;          ///< without, but in 64 bits
    unsigned zeros;          ///< how many they are
    AffineNest::Range range; ///< of `shifted`
    mlir::Value base;
    std::array<mlir::Value, 2> steps;
  };

  /// A function that becomes a floating-point number, hence is needed with all
  /// of its bits: narrow << its zeros, plus what is the same for all pixels.
  struct Conversion {
    mlir::arith::SIToFPOp op;
    size_t leaf;
    mlir::Value rest; ///< null if the leaf is the function itself
  };

  /// A copy of the loops, in which values are narrow.
  struct Version {
    mlir::IRMapping mapping;
    llvm::SmallVector<mlir::scf::ForOp, 2> loops;
    llvm::DenseMap<size_t, mlir::Value> leaves;
  };

  /// A leaf without whose sign a pixel has nothing to do.
  struct RequiredSign {
    size_t leaf;
    bool isNegative;
  };

  bool isTree(mlir::Value value);
  std::optional<SignTest> matchTest(mlir::arith::CmpIOp compare);
  bool isVarying(mlir::arith::SIToFPOp op);
  Affine getAffine(const Leaf &leaf);
  /// The number of a leaf, which is new if `fits` is extended by its test.
  size_t prepare(const Leaf &leaf, mlir::Value &fits);
  void collectLeaves(mlir::Value tree);
  void prepareConversion(mlir::arith::SIToFPOp op);

  void findConversions();

  void findRequired(mlir::Block &block);
  void requireCondition(mlir::Value condition);
  void requireTree(mlir::Value tree, bool isNegative);
  void makeStrips(Version &version);

  mlir::scf::IfOp choose(mlir::Value fits);
  mlir::Value testReach();
  mlir::Block *enter(mlir::Block *block, mlir::Value condition);
  void makeVersions();
  Version copy(mlir::Block *into);
  void narrowTests(Version &version);
  void narrowConversions(Version &version);
  mlir::Value writeLeaf(size_t number, Version &version);
  /// `written` has what this comparison has already.
  mlir::Value writeTree(mlir::Value tree, mlir::OpBuilder &inner,
                        Version &version,
                        llvm::DenseMap<mlir::Value, mlir::Value> &written);

  AffineNest nest;
  llvm::SmallVector<SignTest> tests;
  llvm::SmallVector<Conversion> conversions;
  llvm::SmallVector<Narrow> leaves;
  llvm::SmallVector<RequiredSign> required; ///< none where there are no strips
  int64_t stripWidth;
  bool mayHaveStrips = false;
  size_t signLeaves = 0; ///< The first ones, which comparisons need.
  llvm::DenseMap<mlir::Value, bool> trees;
  llvm::DenseSet<mlir::Value> collected;
  mlir::Value signsFit, valuesFit;
};

/// A number in 32 bits.
mlir::Value cutTo32(mlir::OpBuilder &builder, mlir::Location loc,
                    mlir::Value number);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_NARROWER_H
