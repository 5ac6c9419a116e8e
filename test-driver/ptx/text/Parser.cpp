// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Parser.cpp - Directives of a module of PTX -------------------------===//

#include "ptx/text/Parser.h"

#include <algorithm>

using namespace piko::ptx;

namespace {

/// The values of an initialiser, put into a variable one after the other.
class Initialiser {
public:
  Initialiser(Lexer &lexer, Variable &variable, Type element)
      : lexer(lexer), variable(variable), element(element) {}

  void parse() {
    if (!lexer.accept('{'))
      return parseValue();
    do
      parse();
    while (lexer.accept(','));
    lexer.expect('}');
  }

private:
  void parseValue() {
    uint64_t value = 0;
    if (lexer.peek().kind == Token::Word)
      parseSymbol();
    else
      value = parseNumber();
    for (uint32_t byte = 0; byte < element.bytes(); ++byte)
      variable.data.push_back(static_cast<uint8_t>(value >> 8 * byte));
  }

  void parseSymbol() {
    bool generic = lexer.accept("generic");
    if (generic)
      lexer.expect('(');
    if (element.bits != 64)
      lexer.fail("an address in a variable of 64 bits");
    std::string name(lexer.expectWord("a variable"));
    if (generic)
      lexer.expect(')');
    int64_t addend = 0;
    if (lexer.accept('+'))
      addend = static_cast<int64_t>(lexer.expectCount("an offset"));
    variable.pointers.push_back({variable.data.size(), name, addend});
  }

  uint64_t parseNumber() {
    bool negative = lexer.accept('-');
    const Token &token = lexer.peek();
    std::string text(token.text);
    if (text.starts_with("0f") || text.starts_with("0F") ||
        text.starts_with("0d") || text.starts_with("0D"))
      text[1] = 'x';
    std::optional<uint64_t> value = parseInteger(text);
    if (token.kind != Token::Number || !value)
      lexer.fail("a number");
    lexer.take();
    return negative ? -*value : *value;
  }

  Lexer &lexer;
  Variable &variable;
  Type element;
};

class Parser {
public:
  explicit Parser(std::string_view text) : lexer(text) {}
  ModuleSyntax parse();

private:
  void parseDirective();
  void parseVersion();
  void parseTarget();
  void parseFunction(bool entry);
  void parseParameters(std::vector<Variable> &parameters);
  bool parseAttribute(FunctionSyntax &function);
  std::array<uint32_t, 3> parseExtent();
  void skipSection();

  Lexer lexer;
  ModuleSyntax module;
};

} // namespace

void piko::ptx::skipLine(Lexer &lexer) {
  uint32_t line = lexer.peek().line;
  while (lexer.peek().kind != Token::End && lexer.peek().line == line)
    lexer.take();
}

Variable piko::ptx::parseVariable(Lexer &lexer, Space space) {
  Variable variable;
  variable.space = space;
  variable.line = lexer.peek().line;
  std::optional<Type> element;
  uint32_t vector = 1;
  bool pointer = false;
  while (lexer.peek().kind == Token::Word &&
         lexer.peek().text.starts_with('.')) {
    std::string_view word = lexer.peek().text.substr(1);
    if (std::optional<Type> type = parseType(word)) {
      element = type;
    } else if (word == "align") {
      lexer.take();
      auto alignment = static_cast<uint32_t>(lexer.expectCount("an alignment"));
      // After .ptr it is the alignment of what is pointed to.
      if (!pointer)
        variable.alignment = alignment;
      continue;
    } else if (word == "v2" || word == "v4") {
      vector = static_cast<uint32_t>(word[1] - '0');
    } else if (word == "ptr") {
      pointer = true;
    } else if (!pointer || !parseSpace(word)) {
      lexer.fail("a type");
    }
    lexer.take();
  }
  if (!element || element->isPredicate())
    lexer.fail("a type");
  variable.name = lexer.expectWord("the name of a variable");
  uint64_t count = vector;
  bool unsized = false;
  while (lexer.accept('[')) {
    unsized = lexer.peek().is(']');
    if (!unsized)
      count *= lexer.expectCount("the length of an array");
    lexer.expect(']');
  }
  variable.alignment = std::max(variable.alignment, element->bytes() * vector);
  if (lexer.accept('='))
    Initialiser(lexer, variable, *element).parse();
  variable.size = unsized ? variable.data.size() : count * element->bytes();
  if (variable.data.size() > variable.size)
    throw ParseError(variable.line, "expected at most " +
                                        std::to_string(variable.size) +
                                        " bytes in the initialiser of '" +
                                        variable.name + "'");
  return variable;
}

ModuleSyntax Parser::parse() {
  parseVersion();
  while (lexer.peek().kind != Token::End)
    parseDirective();
  if (!module.target)
    lexer.fail(".target");
  return std::move(module);
}

void Parser::parseVersion() {
  if (!lexer.accept(".version"))
    lexer.fail(".version");
  std::string_view text = lexer.peek().text;
  size_t dot = text.find('.');
  auto major = parseInteger(text.substr(0, dot));
  auto minor =
      dot == text.npos ? std::nullopt : parseInteger(text.substr(dot + 1));
  if (!major || !minor)
    lexer.fail("the version of PTX");
  lexer.take();
  module.versionMajor = static_cast<uint32_t>(*major);
  module.versionMinor = static_cast<uint32_t>(*minor);
}

void Parser::parseTarget() {
  std::string_view name = lexer.peek().text;
  auto number =
      name.starts_with("sm_")
          ? parseInteger(name.substr(3, name.find_last_of("0123456789") - 2))
          : std::nullopt;
  if (!number)
    lexer.fail("a target, such as sm_90");
  lexer.take();
  module.target = static_cast<uint32_t>(*number);
  while (lexer.accept(','))
    if (lexer.expectWord("a feature of the target") != "debug")
      lexer.fail("no feature of the target but debug");
}

void Parser::parseDirective() {
  bool external = false;
  while (lexer.peek().is(".visible") || lexer.peek().is(".extern") ||
         lexer.peek().is(".weak") || lexer.peek().is(".common"))
    external |= lexer.take().text == ".extern";
  Token directive = lexer.peek();
  if (lexer.accept(".target"))
    return parseTarget();
  if (lexer.accept(".address_size")) {
    if (lexer.expectCount("64") != 64)
      throw ParseError(directive.line, "expected addresses of 64 bits");
    return;
  }
  if (directive.is(".file") || directive.is(".loc"))
    return skipLine(lexer);
  if (directive.is(".section"))
    return skipSection();
  if (lexer.accept(".entry"))
    return parseFunction(true);
  if (lexer.accept(".func"))
    return parseFunction(false);
  std::optional<Space> space =
      directive.kind == Token::Word
          ? parseSpace(
                directive.text.substr(directive.text.starts_with('.') ? 1 : 0))
          : std::nullopt;
  if (!space || *space == Space::Local || *space == Space::Param)
    lexer.fail("a directive that is known");
  lexer.take();
  module.variables.push_back(parseVariable(lexer, *space));
  module.variables.back().external = external;
  lexer.expect(';');
}

void Parser::skipSection() {
  lexer.take();
  lexer.expectWord("the name of a section");
  lexer.expect('{');
  while (!lexer.accept('}')) {
    if (lexer.peek().kind == Token::End)
      lexer.fail("'}'");
    lexer.take();
  }
}

std::array<uint32_t, 3> Parser::parseExtent() {
  std::array<uint32_t, 3> extent{1, 1, 1};
  for (uint32_t &count : extent) {
    count = static_cast<uint32_t>(lexer.expectCount("a number of threads"));
    if (!lexer.accept(','))
      break;
  }
  return extent;
}

bool Parser::parseAttribute(FunctionSyntax &function) {
  if (lexer.accept(".maxntid")) {
    function.maxThreads = parseExtent();
    return true;
  }
  if (lexer.accept(".reqntid")) {
    function.requiredThreads = parseExtent();
    return true;
  }
  if (lexer.accept(".maxnreg")) {
    function.maxRegisters =
        static_cast<uint32_t>(lexer.expectCount("a number of registers"));
    return true;
  }
  if (lexer.accept(".minnctapersm")) {
    lexer.expectCount("a number");
    return true;
  }
  return lexer.accept(".noreturn");
}

void Parser::parseParameters(std::vector<Variable> &parameters) {
  if (!lexer.accept('('))
    return;
  if (lexer.accept(')'))
    return;
  do {
    if (!lexer.accept(".param"))
      lexer.fail(".param");
    parameters.push_back(parseVariable(lexer, Space::Param));
  } while (lexer.accept(','));
  lexer.expect(')');
}

void Parser::parseFunction(bool entry) {
  FunctionSyntax function;
  function.entry = entry;
  function.line = lexer.peek().line;
  if (!entry)
    parseParameters(function.results);
  function.name = lexer.expectWord("the name of a function");
  parseParameters(function.parameters);
  while (parseAttribute(function))
    ;
  if (lexer.accept(';'))
    return;
  function.defined = true;
  parseBody(lexer, function);
  module.functions.push_back(std::move(function));
}

ModuleSyntax piko::ptx::parseModule(std::string_view text) {
  return Parser(text).parse();
}
