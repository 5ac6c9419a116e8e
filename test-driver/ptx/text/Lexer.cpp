// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Lexer.cpp - Tokens of PTX ------------------------------------------===//

#include "ptx/text/Lexer.h"

#include <charconv>

using namespace piko::ptx;

static bool isDigit(char c) { return c >= '0' && c <= '9'; }
static bool startsWord(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         c == '$' || c == '%' || c == '.';
}
static bool continuesWord(char c) { return startsWord(c) || isDigit(c); }

void Lexer::skipBlanks() {
  while (at < text.size()) {
    char c = text[at];
    if (c == '\n')
      ++line;
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
      ++at;
    } else if (text.substr(at, 2) == "//") {
      at = std::min(text.find('\n', at), text.size());
    } else if (text.substr(at, 2) == "/*") {
      size_t end = text.find("*/", at);
      if (end == text.npos)
        throw ParseError(line, "comment without end");
      for (; at < end + 2; ++at)
        line += text[at] == '\n';
    } else {
      return;
    }
  }
}

void Lexer::advance() {
  skipBlanks();
  token = {Token::End, {}, line};
  if (at == text.size())
    return;
  size_t end = at + 1;
  char first = text[at];
  if (first == '"') {
    end = text.find('"', end);
    if (end == text.npos)
      throw ParseError(line, "string without end");
    token = {Token::String, text.substr(at + 1, end - at - 1), line};
    at = end + 1;
    return;
  }
  bool isWord = startsWord(first);
  if (isWord || isDigit(first))
    for (; end < text.size(); ++end) {
      // Modifiers such as L2::128B.
      if (isWord && text.substr(end, 2) == "::")
        ++end;
      else if (!continuesWord(text[end]))
        break;
    }
  token.kind = isWord           ? Token::Word
               : isDigit(first) ? Token::Number
                                : Token::Mark;
  token.text = text.substr(at, end - at);
  at = end;
}

void Lexer::fail(const std::string &what) const {
  throw ParseError(token.line,
                   "expected " + what + ", but got '" +
                       (token.kind == Token::End ? std::string("the end")
                                                 : std::string(token.text)) +
                       "'");
}

void Lexer::expect(char mark) {
  if (!accept(mark))
    fail(std::string("'") + mark + "'");
}

std::string_view Lexer::expectWord(const char *what) {
  if (token.kind != Token::Word)
    fail(what);
  return take().text;
}

uint64_t Lexer::expectCount(const char *what) {
  auto value = token.kind == Token::Number ? parseInteger(token.text)
                                           : std::optional<uint64_t>();
  if (!value)
    fail(what);
  advance();
  return *value;
}

std::optional<uint64_t> piko::ptx::parseInteger(std::string_view text) {
  if (text.ends_with('U'))
    text.remove_suffix(1);
  int base = 10;
  if (text.starts_with("0x") || text.starts_with("0X"))
    base = 16;
  else if (text.starts_with("0b") || text.starts_with("0B"))
    base = 2;
  else if (text.size() > 1 && text[0] == '0')
    base = 8;
  text.remove_prefix(base == 10 ? 0 : base == 8 ? 1 : 2);
  uint64_t value = 0;
  auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size())
    return std::nullopt;
  return value;
}
