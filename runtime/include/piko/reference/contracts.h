//===- piko/reference/contracts.h - Numbers that are indices --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_CONTRACTS_H
#define PIKO_REFERENCE_CONTRACTS_H

#include <piko/macros_begin.h>

#include <piko/contract.h>
#include <piko/reference/numbers.h>
#include <piko/reference/state.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace piko::reference {

/// A number of a record that is not below a limit.
struct Outside {
  std::string field, number; ///< the first one is empty if it is the record
};

/// How many components the vectors have that a field is made of, and how many
/// vectors or numbers there are.
template <class Field> struct FieldShape {
  static constexpr int components = 0, count = 1;
  using Element = Field;
};
template <class Field, size_t Count> struct FieldShape<Field[Count]> {
  static constexpr int components = FieldShape<Field>::components,
                       count = Count * FieldShape<Field>::count;
  using Element = typename FieldShape<Field>::Element;
};
template <int Count, class T, glm::qualifier Q>
struct FieldShape<glm::vec<Count, T, Q>> {
  static constexpr int components = Count, count = 1;
  using Element = glm::vec<Count, T, Q>;
};

/// The first number of a field that is not in [0, below), as a compiled
/// pipeline comes to them.
template <class Field>
std::optional<Outside> findOutside(const Field &field, std::string name,
                                   int64_t below) {
  using Shape = FieldShape<Field>;
  const auto *elements =
      reinterpret_cast<const typename Shape::Element *>(&field);
  constexpr bool isVector = Shape::components > 0;
  for (int c = 0; c < std::max(Shape::components, 1); ++c)
    for (int i = 0; i < Shape::count; ++i) {
      auto number = [&] {
        if constexpr (isVector)
          return elements[i][c];
        else
          return elements[i];
      }();
      if (std::cmp_greater_equal(number, 0) && std::cmp_less(number, below))
        continue;
      if (isVector)
        name += (name.empty() ? "" : ".") + std::string(1, "xyzw"[c]);
      if (Shape::count > 1)
        name += "[" + std::to_string(i) + "]";
      return Outside{std::move(name), std::to_string(number)};
    }
  return std::nullopt;
}

/// Records side by side.
struct Records {
  const std::byte *data;
  int64_t count, size; ///< how many, and the bytes of one
};

/// That numbers of a record are below a limit.
struct IndexRule {
  const TypeInfo *record;
  const BufferBase *target = nullptr; ///< the buffer that they index
  int64_t below = 0;                  ///< or what they are below
  std::optional<Outside> (*find)(const std::byte *record, int64_t below);

  /// What the first record breaks that does; empty if none does.
  template <class Name>
  std::string findBreach(const Checker &checker, const Records &records,
                         Name name) const {
    int64_t limit = below;
    std::string expected = " in [0, ";
    if (target) {
      BufferBase::View view = target->view();
      if (!view.isBound)
        return ""; // no phase uses it
      limit = view.count;
      expected = " to be an index into " +
                 stateText(checker.nameOf(target), false, view.type) +
                 ", in [0, ";
    }
    for (int64_t i = 0; i < records.count; ++i)
      if (auto found = find(records.data + i * records.size, limit))
        return "expected " +
               (found->field.empty() ? ""
                                     : "field '" + found->field + "' of ") +
               name(i) + expected + std::to_string(limit) + "), but got " +
               found->number;
    return "";
  }
};

/// What expectIndex says of a source's primitives or a buffer's elements.
struct Contract {
  int source = -1;
  const BufferBase *buffer = nullptr;
  IndexRule rule;

  /// Of a buffer's elements.
  void check(const Checker &checker) const {
    BufferBase::View view = buffer->view();
    if (!view.isBound)
      return;
    std::string breach = rule.findBreach(
        checker, {view.data, view.count, view.size},
        [](int64_t i) { return "element " + std::to_string(i); });
    std::string name = checker.nameOf(buffer);
    if (!breach.empty())
      throw Error((name.empty() ? stateText(name, false, view.type)
                                : "buffer '" + name + "'") +
                  ": " + breach);
  }
};

template <class Limit>
IndexRule makeRule(const TypeInfo *record, const Limit &below) {
  IndexRule rule{.record = record, .find = nullptr};
  if constexpr (std::is_integral_v<Limit>) {
    rule.below = static_cast<int64_t>(below);
    if (below < 1)
      throw Error("expected an index to be below a number of at least 1, but "
                  "got " +
                  std::to_string(below));
  } else {
    rule.target = &below;
  }
  return rule;
}

/// Of a field.
template <auto Field, class Limit> IndexRule makeRule(const Limit &below) {
  using Member = decltype(detail::memberOf(Field));
  using Record = typename Member::Record;
  detail::expectIndexField<typename Member::Type>();
  IndexRule rule = makeRule(typeOf<Record>(), below);
  rule.find = [](const std::byte *record, int64_t limit) {
    return findOutside(reinterpret_cast<const Record *>(record)->*Field,
                       fieldName<Field>(), limit);
  };
  return rule;
}

/// Of all of a record.
template <class Record, class Limit> IndexRule makeRule(const Limit &below) {
  detail::expectIndexField<Record>();
  IndexRule rule = makeRule(typeOf<Record>(), below);
  rule.find = [](const std::byte *record, int64_t limit) {
    return findOutside(*reinterpret_cast<const Record *>(record), "", limit);
  };
  return rule;
}

} // namespace piko::reference

#include <piko/macros_end.h>

#endif // PIKO_REFERENCE_CONTRACTS_H
