//===- LinearSystem.h - Linear inequalities over integers -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Linear expressions, what is known of their variables, and whether an
// inequality follows. MLIR's Presburger library decides conjunctions; what is
// here splits cases and keeps to what an inequality is about.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_ANALYSIS_LINEARSYSTEM_H
#define PIKO_ANALYSIS_LINEARSYSTEM_H

#include "llvm/ADT/DynamicAPInt.h"
#include "llvm/ADT/SmallVector.h"

#include <optional>
#include <vector>

namespace piko {

/// A sum of multiples of variables and a constant.
class Linear {
public:
  Linear(int64_t constant = 0) : constant(constant) {}
  static Linear variable(unsigned number);

  Linear operator+(const Linear &other) const;
  Linear operator-(const Linear &other) const;
  Linear operator*(const llvm::DynamicAPInt &factor) const;
  bool operator==(const Linear &other) const;

  /// The number that it is, if it has no variables.
  std::optional<llvm::DynamicAPInt> getConstant() const;

private:
  friend class LinearSystem;
  using Term = std::pair<unsigned, llvm::DynamicAPInt>;

  llvm::SmallVector<Term, 2> terms; // by variable, none of factor 0
  llvm::DynamicAPInt constant;
};

/// Something that holds of variables: conditions, and choices between
/// alternatives one of which holds.
struct LinearFact {
  struct Condition {
    Linear value;
    bool isZero; ///< else it is at least 0
  };

  std::vector<Condition> conditions;
  std::vector<std::vector<LinearFact>> choices;

  void addAtLeastZero(const Linear &value) {
    conditions.push_back({value, false});
  }
  void addZero(const Linear &value) { conditions.push_back({value, true}); }
  void addBetween(const Linear &low, const Linear &value, const Linear &high) {
    addAtLeastZero(value - low);
    addAtLeastZero(high - value);
  }
  void add(LinearFact fact);
  /// What cannot be.
  void addContradiction() { addAtLeastZero(Linear(-1)); }
};

/// What is known, and what follows from it.
class LinearSystem {
public:
  Linear addVariable() { return Linear::variable(variables++); }
  LinearFact &getFacts() { return facts; }

  /// Whether the value is at least 0 wherever the facts hold. False may mean
  /// that it was not found out with so much effort: cases that are looked at.
  bool isAtLeastZero(const Linear &value, int effort) const;

private:
  struct Search;

  /// How many numbers the matrices of all questions may have; after that
  /// nothing is found out.
  static constexpr int64_t maxWork = 2'000'000;

  LinearFact facts;
  unsigned variables = 0;
  mutable int64_t work = 0;
};

} // namespace piko

#endif // PIKO_ANALYSIS_LINEARSYSTEM_H
