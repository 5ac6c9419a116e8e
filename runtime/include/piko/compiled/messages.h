//===- piko/compiled/messages.h - What static assertions say ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Messages that name the user's types. The front end shows them at the call in
// the user's text.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMPILED_MESSAGES_H
#define PIKO_COMPILED_MESSAGES_H

#include <stddef.h>

namespace piko::detail {

/// A text that is put together when a pipeline is compiled; cut off if long.
class Message {
public:
  constexpr Message &operator<<(const char *text) {
    for (; *text; ++text)
      *this << *text;
    return *this;
  }
  constexpr Message &operator<<(char c) {
    if (length < sizeof(chars))
      chars[length++] = c;
    return *this;
  }
  /// The name of a type, in quotes.
  template <class T> constexpr Message &addType() {
    const char *text = __PRETTY_FUNCTION__; // "... addType() [T = X]"
    while (!(text[0] == 'T' && text[1] == ' ' && text[2] == '='))
      ++text;
    *this << '\'';
    for (text += 4; text[1]; ++text)
      *this << *text;
    return *this << '\'';
  }
  constexpr size_t size() const { return length; }
  constexpr const char *data() const { return chars; }

private:
  char chars[512] = {};
  size_t length = 0;
};

/// That a stage with these ports cannot emit a T.
template <class T, class... Out> constexpr Message portTypes() {
  Message message;
  if (sizeof...(Out) == 0)
    return message << "expected a stage with a port, but this one has none";
  message << "expected to emit ";
  const char *separator = "";
  (((message << separator).template addType<Out>(), separator = " or "), ...);
  return (message << ", as the ports of the stage have, but got ")
      .template addType<T>();
}

/// That a position has not the dimensions of the bins.
template <int Bins, int Got> constexpr Message dimensions() {
  Message message;
  return message << "expected " << char('0' + Bins)
                 << " dimensions, as the bins of the stage have, but got "
                 << char('0' + Got);
}

} // namespace piko::detail

#endif // PIKO_COMPILED_MESSAGES_H
