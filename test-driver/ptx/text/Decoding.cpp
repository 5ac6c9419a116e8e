// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Decoding.cpp - Opcodes and operands of a statement -----------------===//

#include "ptx/text/Decoder.h"

#include <algorithm>

using namespace piko::ptx;

Decoding::Decoding(const Statement &statement, Scope &scope)
    : statement(statement), scope(scope) {
  std::string_view text = statement.opcode;
  size_t dot = text.find('.');
  mnemonic = text.substr(0, dot);
  while (dot != text.npos) {
    text.remove_prefix(dot + 1);
    dot = text.find('.');
    modifiers.push_back(text.substr(0, dot));
  }
  it.line = statement.line;
  if (!statement.guard.empty()) {
    Argument guard;
    guard.kind = Argument::Register;
    guard.name = statement.guard;
    it.guarded = true;
    it.guardNegated = statement.guardNegated;
    it.guard = predicate(guard);
  }
}

void Decoding::fail(const std::string &what) const {
  throw ParseError(statement.line,
                   what + " in '" + std::string(statement.opcode) + "'");
}

bool Decoding::take(std::string_view modifier) {
  auto found = std::find(modifiers.begin(), modifiers.end(), modifier);
  if (found == modifiers.end())
    return false;
  modifiers.erase(found);
  return true;
}

std::string_view
Decoding::takeOneOf(std::initializer_list<std::string_view> names) {
  for (std::string_view name : names)
    if (take(name))
      return name;
  return {};
}

std::optional<Type> Decoding::peekType() const {
  return modifiers.empty() ? std::nullopt : parseType(modifiers.back());
}

Type Decoding::takeType() {
  std::optional<Type> type = peekType();
  if (!type)
    fail("expected a type that is known");
  modifiers.pop_back();
  return *type;
}

std::optional<Space> Decoding::takeSpace() {
  for (auto found = modifiers.begin(); found != modifiers.end(); ++found) {
    // shared::cta, param::entry and param::func
    std::string_view name = found->substr(0, found->find("::"));
    if (std::optional<Space> space = parseSpace(name)) {
      if (name.size() != found->size() && *found != "shared::cta" &&
          *found != "param::entry" && *found != "param::func")
        fail("expected a state space that is known, but got '" +
             std::string(*found) + "'");
      modifiers.erase(found);
      return space;
    }
  }
  return std::nullopt;
}

void Decoding::finish(size_t arguments) {
  if (!modifiers.empty())
    fail("expected an instruction that is known, but got '." +
         std::string(modifiers.front()) + "'");
  if (size() != arguments)
    fail("expected " + std::to_string(arguments) + " operands, but got " +
         std::to_string(size()));
}

const Argument &Decoding::argument(size_t number) const {
  if (number >= size())
    fail("expected more than " + std::to_string(size()) + " operands");
  return statement.arguments[number];
}

Operand Decoding::named(const Argument &argument, Type type, bool exact) {
  Type actual;
  Operand place = scope.registerOf(argument.name, &actual);
  if (actual.isPredicate() != type.isPredicate() ||
      (exact ? actual.bits != type.bits : actual.bits < type.bits))
    fail("expected a register of " + std::to_string(type.bits) +
         " bits, but got '" + argument.name + "' of " +
         std::to_string(actual.bits));
  return place;
}

Operand Decoding::constantOf(const Argument &argument, Type type) {
  auto bits = static_cast<uint64_t>(argument.value);
  auto bytes = static_cast<uint8_t>(std::max(type.bits / 8, 2));
  switch (argument.kind) {
  case Argument::Immediate:
    return scope.constant(bits, bytes);
  case Argument::Float:
    if (argument.width != type.bits)
      fail("expected a number of " + std::to_string(type.bits) + " bits");
    return scope.constant(bits, bytes);
  case Argument::Symbol: {
    Space space = Space::Generic;
    return scope.constant(scope.addressOf(argument.name, space) + bits, bytes);
  }
  default:
    fail("expected a register or a constant");
  }
}

Operand Decoding::result(const Argument &argument, Type type) {
  if (argument.kind == Argument::Sink)
    return scope.scratch(
        type.isPredicate() ? 0 : static_cast<uint8_t>(type.bytes()));
  if (argument.kind != Argument::Register)
    fail("expected a register for the result");
  return written.emplace_back(named(argument, type, true));
}

Operand Decoding::value(const Argument &argument, Type type) {
  if (argument.kind == Argument::Register)
    return read.emplace_back(named(argument, type, true));
  return constantOf(argument, type);
}

Operand Decoding::wideResult(const Argument &argument, Type type) {
  if (argument.kind == Argument::Sink)
    return scope.scratch(8);
  if (argument.kind != Argument::Register)
    fail("expected a register for the result");
  return written.emplace_back(named(argument, type, false));
}

Operand Decoding::wideValue(const Argument &argument, Type type) {
  if (argument.kind == Argument::Register)
    return read.emplace_back(named(argument, type, false));
  return constantOf(argument, type);
}

Operand Decoding::predicate(const Argument &argument, bool *negated) {
  if (negated)
    *negated = argument.negated;
  else if (argument.negated)
    fail("expected a predicate without '!'");
  if (argument.kind == Argument::Immediate)
    return scope.constant(argument.value ? ~uint64_t(0) : 0, 0);
  if (argument.kind != Argument::Register)
    fail("expected a predicate");
  return read.emplace_back(named(argument, Type{Kind::Predicate, 1}, true));
}

Operand Decoding::result(size_t number, Type type) {
  return result(argument(number), type);
}
Operand Decoding::value(size_t number, Type type) {
  return value(argument(number), type);
}
Operand Decoding::predicate(size_t number, bool *negated) {
  return predicate(argument(number), negated);
}

void Decoding::address(size_t number) {
  const Argument &given = argument(number);
  if (given.kind != Argument::Address)
    fail("expected an address");
  const Argument &base = given.parts[0];
  it.offset = given.value;
  if (base.kind == Argument::Register) {
    Type type;
    it.a = read.emplace_back(scope.registerOf(base.name, &type));
    if (type.bits < 32)
      fail("expected an address of 32 or 64 bits");
    return;
  }
  it.a = constantOf(base, Type{Kind::Bits, 64});
}

uint64_t Decoding::immediate(size_t number) {
  if (argument(number).kind != Argument::Immediate)
    fail("expected an integer");
  return static_cast<uint64_t>(argument(number).value);
}
