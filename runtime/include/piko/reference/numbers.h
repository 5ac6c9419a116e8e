//===- piko/reference/numbers.h - Fields that must not be NaN -------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_REFERENCE_NUMBERS_H
#define PIKO_REFERENCE_NUMBERS_H

#include <piko/reference/error.h>

#include <cstddef>
#include <iterator>
#include <type_traits>

namespace piko::reference {

/// Whether a float, or one in an array or a GLM vector or matrix, is NaN.
template <class T> bool hasNaN(const T &value) {
  if constexpr (std::is_floating_point_v<T>) {
    return value != value;
  } else if constexpr (requires { value.length(), value[0]; }) {
    for (int i = 0; i < static_cast<int>(value.length()); ++i)
      if (hasNaN(value[i]))
        return true;
    return false;
  } else if constexpr (requires { std::begin(value); }) {
    for (const auto &element : value)
      if (hasNaN(element))
        return true;
    return false;
  } else {
    static_assert(std::is_floating_point_v<T>,
                  "a field that holds numbers is a float, a double, or an "
                  "array, vector or matrix of them");
    return false;
  }
}

/// A field of a record, by its pointer to member.
template <auto Field> std::string fieldName() {
  std::string_view text = __PRETTY_FUNCTION__;
  // "... [Field = &Record::z]" by Clang, "... [with auto Field = ...; ...]" by
  // GCC.
  size_t end = text.find(';', text.find("Field = "));
  if (end == std::string_view::npos)
    end = text.rfind(']');
  text = text.substr(0, end);
  return std::string(text.substr(text.rfind(':') + 1));
}

struct NumberField {
  const TypeInfo *record;
  std::string name;
  bool (*hasNaN)(const std::byte *primitive);
};

template <class Record, class Member, Member Record::*Field>
NumberField makeNumberField() {
  return {typeOf<Record>(), fieldName<Field>(), [](const std::byte *primitive) {
            return reference::hasNaN(
                reinterpret_cast<const Record *>(primitive)->*Field);
          }};
}

} // namespace piko::reference

#endif // PIKO_REFERENCE_NUMBERS_H
