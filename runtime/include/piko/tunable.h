//===- piko/tunable.h - Constants that a tuner may choose -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   constexpr int tile = piko::tunable("tile", 16, 8, 32, 64);
//
// is 16, unless the macro PIKO_TUNED is a string that says otherwise, such as
// "tile=32;leaf=4": then it is what that says, and a compilation with a value
// that is not one of those listed ends at this line. It is all decided while a
// compiler, any one, reads the text.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TUNABLE_H
#define PIKO_TUNABLE_H

#include <concepts>
#include <initializer_list>
#include <type_traits>

namespace piko {

namespace detail {

/// What PIKO_TUNED says, for T = void. The compiler, whose precompiled piko.h
/// is the same for all settings, specializes it before the user's text.
template <class T>
inline constexpr const char *tunedText =
#ifdef PIKO_TUNED
    PIKO_TUNED;
#else
    "";
#endif

// What ends the evaluation of a constant: they are not constexpr.
inline void tunedValueIsNotLegal() {}
inline void tunableHasNoValidName() {}

consteval bool isTunableName(const char *name) {
  if (*name == '\0')
    return false;
  for (; *name; ++name)
    if (*name == '=' || *name == ';' || *name == ' ' || *name == '"')
      return false;
  return true;
}

/// What follows `name=` in the text; null if nothing does.
consteval const char *findTuned(const char *text, const char *name) {
  while (*text) {
    const char *rest = name;
    while (*rest && *text == *rest)
      ++text, ++rest;
    if (!*rest && *text == '=')
      return text + 1;
    while (*text && *text != ';')
      ++text;
    if (*text)
      ++text;
  }
  return nullptr;
}

consteval bool isWord(const char *text, const char *word) {
  while (*word && *text == *word)
    ++text, ++word;
  return !*word && (!*text || *text == ';');
}

/// Reads digits, and counts them; the text then points after them.
consteval int readDigits(const char *&text, unsigned long long &number) {
  int count = 0;
  for (; *text >= '0' && *text <= '9'; ++text, ++count)
    number = number * 10 + static_cast<unsigned long long>(*text - '0');
  return count;
}

template <class T> consteval bool isWholeNumber(const char *text, T value) {
  bool isNegative = *text == '-';
  text += isNegative;
  unsigned long long number = 0;
  if (readDigits(text, number) == 0 || (*text && *text != ';'))
    return false;
  auto bits = static_cast<unsigned long long>(value);
  return (value < T(0)) == isNegative &&
         bits == (isNegative ? -number : number);
}

/// Whether the text is the decimal form of a number, to six digits.
consteval bool isRealNumber(const char *text, double value) {
  bool isNegative = *text == '-';
  text += isNegative;
  unsigned long long digits = 0, power = 0;
  int count = readDigits(text, digits), exponent = 0;
  if (*text == '.') {
    ++text;
    exponent = -readDigits(text, digits);
    count -= exponent;
  }
  if (*text == 'e') {
    ++text;
    bool isSmall = *text == '-';
    text += *text == '-' || *text == '+';
    if (readDigits(text, power) == 0 || power > 400)
      return false;
    exponent += isSmall ? -int(power) : int(power);
  }
  if (count == 0 || (*text && *text != ';'))
    return false;
  double number = static_cast<double>(digits);
  for (; exponent > 0; --exponent)
    number *= 10;
  for (; exponent < 0; ++exponent)
    number /= 10;
  double difference = (isNegative ? -number : number) - value;
  double most = (value < 0 ? -value : value) * 1e-6;
  return difference <= most && -difference <= most;
}

template <class T> consteval bool isTuned(const char *text, T value) {
  if constexpr (std::is_same_v<T, bool>)
    return isWord(text, value ? "true" : "false") ||
           isWord(text, value ? "1" : "0");
  else if constexpr (std::is_enum_v<T>)
    return isTuned(text, static_cast<std::underlying_type_t<T>>(value));
  else if constexpr (std::is_integral_v<T>)
    return isWholeNumber(text, value);
  else
    return isRealNumber(text, double(value));
}

} // namespace detail

/// The first value, unless PIKO_TUNED names another one of the list: a bool, an
/// integer, a float or an enumerator. A name has no `=`, `;`, quote or space.
template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
consteval T tunable(const char *name, T standard,
                    std::same_as<T> auto... others) {
  if (!detail::isTunableName(name))
    detail::tunableHasNoValidName();
  // Depends on T, so that nothing is decided where only the header is read.
  using Void = decltype(static_cast<void>(T()));
  const char *text = detail::findTuned(detail::tunedText<Void>, name);
  if (!text)
    return standard;
  for (T value : {standard, others...})
    if (detail::isTuned(text, value))
      return value;
  detail::tunedValueIsNotLegal();
  return standard;
}

} // namespace piko

#endif // PIKO_TUNABLE_H
