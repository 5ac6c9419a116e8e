//===- LinearSystem.cpp - Linear inequalities over integers ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Analysis/LinearSystem.h"

#include "mlir/Analysis/Presburger/IntegerRelation.h"
#include "mlir/Analysis/Presburger/Simplex.h"
#include "llvm/ADT/DenseMap.h"

using namespace piko;
using llvm::DynamicAPInt;
using mlir::presburger::IntegerPolyhedron;
using mlir::presburger::PresburgerSpace;

//===----------------------------------------------------------------------===//
// Expressions
//===----------------------------------------------------------------------===//

Linear Linear::variable(unsigned number) {
  Linear result;
  result.terms.emplace_back(number, DynamicAPInt(1));
  return result;
}

Linear Linear::operator+(const Linear &other) const {
  Linear result;
  result.constant = constant + other.constant;
  const Term *a = terms.begin(), *b = other.terms.begin();
  while (a != terms.end() || b != other.terms.end()) {
    if (b == other.terms.end() || (a != terms.end() && a->first < b->first)) {
      result.terms.push_back(*a++);
    } else if (a == terms.end() || b->first < a->first) {
      result.terms.push_back(*b++);
    } else {
      DynamicAPInt factor = a->second + b->second;
      if (factor != 0)
        result.terms.emplace_back(a->first, factor);
      ++a, ++b;
    }
  }
  return result;
}

Linear Linear::operator*(const DynamicAPInt &factor) const {
  Linear result;
  if (factor == 0)
    return result;
  result.constant = constant * factor;
  for (const Term &term : terms)
    result.terms.emplace_back(term.first, term.second * factor);
  return result;
}

Linear Linear::operator-(const Linear &other) const {
  return *this + other * DynamicAPInt(-1);
}

bool Linear::operator==(const Linear &other) const {
  return constant == other.constant && terms == other.terms;
}

std::optional<DynamicAPInt> Linear::getConstant() const {
  return terms.empty() ? std::optional(constant) : std::nullopt;
}

void LinearFact::add(LinearFact fact) {
  llvm::append_range(conditions, std::move(fact.conditions));
  llvm::append_range(choices, std::move(fact.choices));
}

//===----------------------------------------------------------------------===//
// Proofs
//===----------------------------------------------------------------------===//

/// A search for values that the facts allow. Cases are split where a choice is
/// about what the question is about, nearest first, and then the one made last:
/// it is nearer to the question in the program.
struct LinearSystem::Search {
  using Condition = LinearFact::Condition;
  using Choice = std::vector<LinearFact>;

  llvm::SmallVector<const Condition *> conditions;
  llvm::SmallVector<const Choice *> choices;
  int &left;
  int64_t &work;

  Search(int &left, int64_t &work) : left(left), work(work) {}

  void add(const LinearFact &fact) {
    for (const Condition &condition : fact.conditions)
      conditions.push_back(&condition);
    for (const Choice &choice : fact.choices)
      choices.push_back(&choice);
  }

  /// What the question is about; alternatives that are looked at belong to it.
  llvm::SmallVector<const Condition *> question;

  bool isEmpty();

private:
  /// The distance from the question, by variable: one more for each condition
  /// in between.
  llvm::DenseMap<unsigned, unsigned> measure() const;
  bool
  isConjunctionEmpty(const llvm::DenseMap<unsigned, unsigned> &distance) const;
};

llvm::DenseMap<unsigned, unsigned> LinearSystem::Search::measure() const {
  llvm::DenseMap<unsigned, unsigned> distance;
  for (const Condition *condition : question)
    for (const auto &[variable, factor] : condition->value.terms)
      distance[variable] = 0;
  for (unsigned round = 1; true; ++round) {
    llvm::SmallVector<unsigned> reached;
    for (const Condition *condition : conditions) {
      bool touches = llvm::any_of(condition->value.terms, [&](auto &term) {
        return distance.contains(term.first);
      });
      for (const auto &[variable, factor] : condition->value.terms)
        if (touches && !distance.contains(variable))
          reached.push_back(variable);
    }
    if (reached.empty())
      return distance;
    for (unsigned variable : reached)
      distance.try_emplace(variable, round);
  }
}

bool LinearSystem::Search::isConjunctionEmpty(
    const llvm::DenseMap<unsigned, unsigned> &distance) const {
  llvm::DenseMap<unsigned, unsigned> columns;
  for (auto [variable, ignored] : distance)
    columns.try_emplace(variable, columns.size());
  IntegerPolyhedron set(PresburgerSpace::getSetSpace(columns.size()));
  llvm::SmallVector<DynamicAPInt> row;
  for (const Condition *condition : conditions) {
    if (!condition->value.terms.empty() &&
        !distance.contains(condition->value.terms.front().first))
      continue; // about something else
    row.assign(columns.size() + 1, DynamicAPInt(0));
    for (const auto &[variable, factor] : condition->value.terms)
      row[columns.lookup(variable)] = factor;
    row.back() = condition->value.constant;
    if (condition->isZero)
      set.addEquality(row);
    else
      set.addInequality(row);
  }
  // Whether there are only fractions is not asked: that may take for ever, and
  // integers are tightened where they are made.
  work += int64_t(set.getNumConstraints()) * set.getNumCols();
  return set.isEmptyByGCDTest() || mlir::presburger::Simplex(set).isEmpty();
}

bool LinearSystem::Search::isEmpty() {
  if (left-- <= 0 || work > maxWork)
    return false;
  llvm::DenseMap<unsigned, unsigned> distance = measure();
  if (isConjunctionEmpty(distance))
    return true;
  auto measureFact = [&](auto &&self, const LinearFact &fact) -> unsigned {
    unsigned least = ~0u;
    for (const Condition &condition : fact.conditions)
      for (const auto &[variable, factor] : condition.value.terms)
        if (auto found = distance.find(variable); found != distance.end())
          least = std::min(least, found->second);
    for (const Choice &choice : fact.choices)
      for (const LinearFact &inner : choice)
        least = std::min(least, self(self, inner));
    return least;
  };
  const Choice **nearest = nullptr;
  unsigned least = ~0u;
  for (const Choice *&choice : choices)
    for (const LinearFact &alternative : *choice)
      if (unsigned at = measureFact(measureFact, alternative);
          at <= least && at != ~0u) {
        least = at;
        nearest = &choice;
      }
  if (!nearest)
    return false;
  const Choice *choice = *nearest;
  for (const LinearFact &alternative : *choice) {
    Search inner(left, work);
    inner.conditions = conditions;
    inner.choices = choices;
    llvm::erase(inner.choices, choice);
    inner.add(alternative);
    inner.question = question;
    for (const Condition &condition : alternative.conditions)
      inner.question.push_back(&condition);
    if (!inner.isEmpty())
      return false;
  }
  return true;
}

bool LinearSystem::isAtLeastZero(const Linear &value, int effort) const {
  if (std::optional<DynamicAPInt> constant = value.getConstant();
      constant && *constant >= 0)
    return true;
  LinearFact::Condition opposite{Linear(-1) - value, false};
  Search search(effort, work);
  search.add(facts);
  search.conditions.push_back(&opposite);
  search.question.push_back(&opposite);
  return search.isEmpty();
}
