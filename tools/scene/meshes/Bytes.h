//===- Bytes.h - Reads bytes and words no further than they go --*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_TOOLS_SCENE_BYTES_H
#define PIKO_TOOLS_SCENE_BYTES_H

#include <algorithm>
#include <charconv>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

namespace piko::render {

/// Whether `length` bytes from `offset` on lie within `total`.
inline bool liesWithin(uint64_t offset, uint64_t length, uint64_t total) {
  return offset <= total && length <= total - offset;
}

/// The number whose bytes are at `bytes`, which holds enough of them.
template <class T> T loadBytes(const char *bytes, bool isBigEndian = false) {
  char own[sizeof(T)];
  std::memcpy(own, bytes, sizeof(T));
  if (isBigEndian)
    std::reverse(own, own + sizeof(T));
  T value;
  std::memcpy(&value, own, sizeof(T));
  return value;
}

inline bool isBlank(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' ||
         c == '\f';
}

/// Takes the next word of a text; "" if there is none.
inline std::string_view takeWord(std::string_view &text) {
  size_t first = 0;
  while (first < text.size() && isBlank(text[first]))
    ++first;
  size_t end = first;
  while (end < text.size() && !isBlank(text[end]))
    ++end;
  std::string_view word = text.substr(first, end - first);
  text.remove_prefix(end);
  return word;
}

/// Reads a whole word as a number, with a point whatever the locale is.
/// \returns false if it is none. What is too large is infinite, or, as an
/// integer, no number.
template <class T> bool parseNumber(std::string_view word, T &value) {
  if (word.starts_with('+')) {
    word.remove_prefix(1);
    if (word.starts_with('-'))
      return false;
  }
  const char *end = word.data() + word.size();
  auto [stop, code] = std::from_chars(word.data(), end, value);
  if (stop != end || word.empty())
    return false;
  if (code == std::errc())
    return true;
  if constexpr (std::floating_point<T>) {
    if (code != std::errc::result_out_of_range)
      return false;
    bool isNegative = word.starts_with('-');
    word.remove_prefix(isNegative);
    size_t exponent = word.find_first_of("eE");
    bool isSmall = exponent == word.npos
                       ? word.starts_with("0") || word.starts_with(".")
                       : word.substr(exponent + 1).starts_with('-');
    value = isSmall ? T(0) : std::numeric_limits<T>::infinity();
    value = isNegative ? -value : value;
    return true;
  }
  return false;
}

/// A word as messages quote it: not more than 40 characters.
inline std::string quoteWord(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + "'";
}

/// Whether a text begins as one in UTF-16 does.
inline bool isUtf16(std::string_view text) {
  return text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") ||
         (text.size() > 1 && (text[0] == 0) != (text[1] == 0));
}

constexpr std::string_view byteOrderMark = "\xef\xbb\xbf";

} // namespace piko::render

#endif // PIKO_TOOLS_SCENE_BYTES_H
