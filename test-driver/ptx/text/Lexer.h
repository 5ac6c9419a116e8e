// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Lexer.h - Tokens of PTX --------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_LEXER_H
#define PIKO_TEST_DRIVER_PTX_LEXER_H

#include "ptx/text/Type.h"

namespace piko::ptx {

struct Token {
  enum Kind : uint8_t {
    Word,   ///< A name, directive or opcode with all its dots: ld.global.b32
    Number, ///< Begins with a digit.
    String, ///< Without its quotes.
    Mark,   ///< One character.
    End
  };
  Kind kind = End;
  std::string_view text; ///< Of the module's text.
  uint32_t line = 0;     ///< From 1.

  bool is(char mark) const { return kind == Mark && text[0] == mark; }
  bool is(std::string_view word) const { return kind == Word && text == word; }
};

/// Gives the tokens of a text, which must outlive them. Comments are left out.
class Lexer {
public:
  explicit Lexer(std::string_view text) : text(text) { advance(); }

  const Token &peek() const { return token; }
  Token take() {
    Token taken = token;
    advance();
    return taken;
  }
  /// Takes the mark or word if it is the next token.
  bool accept(char mark) { return token.is(mark) && (advance(), true); }
  bool accept(std::string_view word) {
    return token.is(word) && (advance(), true);
  }
  void expect(char mark);
  std::string_view expectWord(const char *what);
  /// A number without sign.
  uint64_t expectCount(const char *what);
  [[noreturn]] void fail(const std::string &what) const;

private:
  void advance();
  void skipBlanks();

  std::string_view text;
  size_t at = 0;
  uint32_t line = 1;
  Token token;
};

/// An integer as PTX writes it: decimal, 0x, 0b or octal, with or without U;
/// none if it is no such number.
std::optional<uint64_t> parseInteger(std::string_view text);

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_LEXER_H
