// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- layout.hpp - Which types a host may use for a record ---------------===//

#ifndef PIKORT_LAYOUT_HPP
#define PIKORT_LAYOUT_HPP

#include <ranges>
#include <type_traits>

namespace piko::rt {

template <class T>
constexpr bool isNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// T has the layout of the record R. A class may stand for an array.
template <class T, class R>
concept LaidOutAs =
    std::is_trivially_copyable_v<T> && sizeof(T) == sizeof(R) &&
    alignof(T) % alignof(R) == 0 &&
    (isNumber<R> ? isNumber<T> && std::is_floating_point_v<T> ==
                                      std::is_floating_point_v<R>
                 : std::is_class_v<T> || std::is_union_v<T>);

/// A vector, an array or a span whose elements have the layout of R.
template <class Range, class R>
concept RangeOf =
    std::ranges::contiguous_range<Range> && std::ranges::sized_range<Range> &&
    LaidOutAs<std::ranges::range_value_t<Range>, R>;

/// Whether its elements stay when an argument of that type goes.
template <class Range>
constexpr bool outlives = std::is_lvalue_reference_v<Range> ||
                          std::ranges::enable_borrowed_range<Range>;

} // namespace piko::rt

#endif // PIKORT_LAYOUT_HPP
