// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Body.cpp - Parser of the body of a function of PTX -----------------===//

#include "ptx/text/Parser.h"

#include <bit>
#include <set>
#include <utility>

using namespace piko::ptx;

namespace {

class BodyParser {
public:
  BodyParser(Lexer &lexer, FunctionSyntax &function)
      : lexer(lexer), function(function) {}
  void parse();

private:
  void parseItem();
  void parseDirective();
  void parseRegisters();
  void parseVariables(Space space);
  void parseBranchTargets(std::string_view label);
  void parseStatement(std::string_view opcode, Statement statement);
  void parseLabel(const Token &name);
  Argument parseArgument();
  Argument parseAtom();
  Argument parseName();
  Argument parseNumber(bool negative);
  std::vector<Argument> parseList(char end);
  int64_t parseOffset();
  std::string resolve(std::string_view name) const;
  std::string declare(std::string_view name, size_t number);

  Lexer &lexer;
  FunctionSyntax &function;
  /// From the names that a scope declares to unique ones: sequences of calls
  /// declare the same parameters again and again.
  std::vector<std::map<std::string, std::string, std::less<>>> scopes;
  std::set<std::string> registers; ///< Whose names have no %, in effect.
};

} // namespace

void BodyParser::parse() {
  lexer.expect('{');
  scopes.emplace_back();
  while (!scopes.empty())
    parseItem();
  for (const auto &[name, targets] : function.branchTargets)
    for (const std::string &target : targets)
      if (!function.labels.contains(target))
        throw ParseError(function.line, "expected a label '" + target + "'");
}

void BodyParser::parseItem() {
  if (lexer.accept('{')) {
    scopes.emplace_back();
    return;
  }
  if (lexer.accept('}')) {
    scopes.pop_back();
    return;
  }
  if (lexer.accept(';'))
    return;
  if (lexer.peek().kind == Token::Word && lexer.peek().text.starts_with('.'))
    return parseDirective();

  Statement statement;
  statement.line = lexer.peek().line;
  if (lexer.accept('@')) {
    statement.guardNegated = lexer.accept('!');
    statement.guard = resolve(lexer.expectWord("a predicate"));
  }
  Token word = lexer.peek();
  lexer.expectWord("an instruction");
  if (statement.guard.empty() && lexer.accept(':'))
    return parseLabel(word);
  parseStatement(word.text, std::move(statement));
}

void BodyParser::parseLabel(const Token &name) {
  if (lexer.accept(".branchtargets"))
    return parseBranchTargets(name.text);
  if (!function.labels.emplace(name.text, function.statements.size()).second)
    throw ParseError(name.line, "expected one label '" +
                                    std::string(name.text) +
                                    "', but got another");
}

void BodyParser::parseBranchTargets(std::string_view label) {
  std::vector<std::string> &targets =
      function.branchTargets[std::string(label)];
  do
    targets.emplace_back(lexer.expectWord("a label"));
  while (lexer.accept(','));
  lexer.expect(';');
}

void BodyParser::parseDirective() {
  if (lexer.peek().is(".loc") || lexer.peek().is(".file"))
    return skipLine(lexer);
  if (lexer.accept(".reg"))
    return parseRegisters();
  if (lexer.accept(".pragma")) {
    if (lexer.take().kind != Token::String)
      lexer.fail("a string");
    return lexer.expect(';');
  }
  std::optional<Space> space = parseSpace(lexer.peek().text.substr(1));
  if (!space)
    lexer.fail("a directive that is known");
  lexer.take();
  parseVariables(*space);
}

void BodyParser::parseRegisters() {
  std::string_view name = lexer.peek().text;
  std::optional<Type> type = parseType(name.substr(name.starts_with('.')));
  if (!type)
    lexer.fail("a type of registers");
  lexer.take();
  do {
    RegisterFamily family;
    family.type = *type;
    family.prefix = declare(lexer.expectWord("the name of a register"),
                            function.registers.size());
    if (lexer.accept('<')) {
      family.count =
          static_cast<uint32_t>(lexer.expectCount("a number of registers"));
      lexer.expect('>');
    }
    if (!family.count)
      registers.insert(family.prefix);
    function.registers.push_back(std::move(family));
  } while (lexer.accept(','));
  lexer.expect(';');
}

void BodyParser::parseVariables(Space space) {
  Variable variable = parseVariable(lexer, space);
  lexer.expect(';');
  variable.name = declare(variable.name, function.variables.size());
  function.variables.push_back(std::move(variable));
}

/// Makes a name of the innermost scope; returns its unique one.
std::string BodyParser::declare(std::string_view name, size_t number) {
  std::string unique(name);
  if (scopes.size() > 1)
    unique += "#" + std::to_string(number);
  scopes.back()[std::string(name)] = unique;
  return unique;
}

std::string BodyParser::resolve(std::string_view name) const {
  for (auto scope = scopes.rbegin(); scope != scopes.rend(); ++scope)
    if (auto found = scope->find(name); found != scope->end())
      return found->second;
  return std::string(name);
}

void BodyParser::parseStatement(std::string_view opcode, Statement statement) {
  statement.opcode = opcode;
  if (!lexer.peek().is(';'))
    do
      statement.arguments.push_back(parseArgument());
    while (lexer.accept(','));
  lexer.expect(';');
  function.statements.push_back(std::move(statement));
}

std::vector<Argument> BodyParser::parseList(char end) {
  std::vector<Argument> parts;
  if (lexer.accept(end))
    return parts;
  do
    parts.push_back(parseArgument());
  while (lexer.accept(','));
  lexer.expect(end);
  return parts;
}

Argument BodyParser::parseArgument() {
  Argument argument;
  if (lexer.accept('{')) {
    argument.kind = Argument::Vector;
    argument.parts = parseList('}');
    return argument;
  }
  if (lexer.accept('(')) {
    argument.kind = Argument::List;
    argument.parts = parseList(')');
    return argument;
  }
  if (lexer.accept('[')) {
    argument.kind = Argument::Address;
    argument.parts.push_back(parseAtom());
    // A symbol has taken its offset.
    argument.value = argument.parts[0].kind == Argument::Symbol
                         ? std::exchange(argument.parts[0].value, 0)
                         : parseOffset();
    lexer.expect(']');
    return argument;
  }
  argument = parseAtom();
  if (!lexer.accept('|'))
    return argument;
  Argument pair;
  pair.kind = Argument::Pair;
  pair.parts.push_back(std::move(argument));
  pair.parts.push_back(parseAtom());
  return pair;
}

int64_t BodyParser::parseOffset() {
  if (lexer.accept('+')) {
    bool negative = lexer.accept('-');
    auto offset = static_cast<int64_t>(lexer.expectCount("an offset"));
    return negative ? -offset : offset;
  }
  if (lexer.accept('-'))
    return -static_cast<int64_t>(lexer.expectCount("an offset"));
  return 0;
}

Argument BodyParser::parseAtom() {
  if (lexer.accept('!')) {
    Argument argument = parseName();
    argument.negated = true;
    return argument;
  }
  if (lexer.accept('-'))
    return parseNumber(true);
  return lexer.peek().kind == Token::Number ? parseNumber(false) : parseName();
}

Argument BodyParser::parseName() {
  std::string_view name = lexer.expectWord("an operand");
  Argument argument;
  if (name == "_") {
    argument.kind = Argument::Sink;
    return argument;
  }
  argument.name = resolve(name);
  argument.kind = name[0] == '%' || registers.contains(argument.name)
                      ? Argument::Register
                      : Argument::Symbol;
  if (argument.kind == Argument::Symbol)
    argument.value = parseOffset();
  return argument;
}

Argument BodyParser::parseNumber(bool negative) {
  Argument argument;
  std::string text(lexer.peek().text);
  bool isSingle = text.starts_with("0f") || text.starts_with("0F");
  bool isDouble = text.starts_with("0d") || text.starts_with("0D");
  if (isSingle || isDouble) {
    argument.kind = Argument::Float;
    argument.width = isSingle ? 32 : 64;
    text[1] = 'x';
  }
  std::optional<uint64_t> value = parseInteger(text);
  if (!value || lexer.peek().kind != Token::Number)
    lexer.fail("a number");
  lexer.take();
  if (argument.kind == Argument::Float && negative)
    *value ^= uint64_t(1) << (argument.width - 1);
  argument.value = std::bit_cast<int64_t>(
      argument.kind != Argument::Float && negative ? -*value : *value);
  return argument;
}

void piko::ptx::parseBody(Lexer &lexer, FunctionSyntax &function) {
  BodyParser(lexer, function).parse();
}
