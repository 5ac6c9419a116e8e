//===- piko/contract.h - Numbers that are indices
//--------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What expectIndex of a pipeline's constructor takes.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_CONTRACT_H
#define PIKO_CONTRACT_H

#include <piko/macros_begin.h>

#include <piko/bins.h>

#include <stdint.h>
#include <type_traits>

namespace piko::detail {

/// The number that a field is made of: it is one, or an array or a GLM vector
/// of some.
template <class T> struct NumberOf {
  using type = T;
};
template <class T, size_t Count> struct NumberOf<T[Count]> : NumberOf<T> {};
template <int Count, class T, glm::qualifier Q>
struct NumberOf<glm::vec<Count, T, Q>> : NumberOf<T> {};

/// The type of a field, whose numbers are indices.
template <class Field> constexpr bool expectIndexField() {
  using Number = typename NumberOf<Field>::type;
  static_assert(std::is_integral_v<Number> && !isSame<Number, bool>,
                "expected a field of integers: one, or an array or a GLM "
                "vector of them");
  return std::is_signed_v<Number>;
}

template <class RecordType, class MemberType> struct Member {
  using Record = RecordType;
  using Type = MemberType;
};
template <class Record, class Type>
Member<Record, Type> memberOf(Type Record::*);

} // namespace piko::detail

#include <piko/macros_end.h>

#endif // PIKO_CONTRACT_H
