// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Decoder.h - From statements to instructions ------------------------===//
//
// A file for each group of instructions, such as Integer.cpp, has their
// handlers and a function that decodes them. It takes from the opcode the
// modifiers that it knows; what is left over is an error.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_DECODER_H
#define PIKO_TEST_DRIVER_PTX_DECODER_H

#include "ptx/text/Program.h"

namespace piko::ptx {

/// The functions and variables that instructions name, and the registers and
/// constants of the program.
class Scope {
public:
  virtual ~Scope() = default;

  virtual Operand registerOf(const std::string &name, Type *type) = 0;
  virtual Operand scratch(uint8_t bytes) = 0;
  virtual Operand constant(uint64_t bits, uint8_t bytes) = 0;
  /// The address of a variable in its own space.
  virtual uint64_t addressOf(const std::string &symbol, Space &space) = 0;
  virtual uint32_t addList(std::vector<Operand> list) = 0;
  virtual uint32_t addCopies(Copies copies) = 0;
  /// Throws ParseError if the module does not define it.
  virtual const FunctionSyntax &functionOf(const std::string &name) = 0;
  /// Where a function's parameter or result lies among those of calls.
  virtual Parameter parameterOf(const FunctionSyntax &function,
                                const Variable &variable) = 0;
};

/// A statement that is decoded.
class Decoding {
public:
  Decoding(const Statement &statement, Scope &scope);

  std::string_view base() const { return mnemonic; }
  /// Takes a modifier, if it is there.
  bool take(std::string_view modifier);
  /// Takes the first of these that is there; empty if none is.
  std::string_view takeOneOf(std::initializer_list<std::string_view> names);
  /// Takes the last modifier, which must be a type.
  Type takeType();
  std::optional<Space> takeSpace();
  /// The last modifier's type, which stays; none if it is no type.
  std::optional<Type> peekType() const;
  /// All modifiers must have been taken, and there must be so many operands.
  void finish(size_t arguments);

  size_t size() const { return statement.arguments.size(); }
  const Argument &argument(size_t number) const;
  /// A register that is written, of the type's width.
  Operand result(size_t number, Type type);
  Operand value(size_t number, Type type);
  /// \p negated says whether ! is in front; none may be where it is null.
  Operand predicate(size_t number, bool *negated = nullptr);
  Operand result(const Argument &argument, Type type);
  Operand value(const Argument &argument, Type type);
  Operand predicate(const Argument &argument, bool *negated = nullptr);
  /// A register of at least the type's width, as ld, st and cvt take them.
  Operand wideResult(const Argument &argument, Type type);
  Operand wideValue(const Argument &argument, Type type);
  /// Into it.a and it.offset.
  void address(size_t number);
  uint64_t immediate(size_t number);

  [[noreturn]] void fail(const std::string &what) const;

  const Statement &statement;
  Scope &scope;
  Instruction it;
  /// Where `it` goes; empty if nowhere. The decoder sets it.target.
  std::string branchLabel, callee;
  std::string branchTable; ///< As well, and it.extra.
  /// After a call: copies its results. None if its handler is null.
  Instruction after;
  std::vector<Operand> read, written; ///< Registers.

private:
  Operand named(const Argument &argument, Type type, bool exact);
  Operand constantOf(const Argument &argument, Type type);

  std::string_view mnemonic;
  std::vector<std::string_view> modifiers;
};

// Each decodes a statement if it is of its group, and returns whether it is.
bool decodeInteger(Decoding &decoding);
bool decodeLogic(Decoding &decoding);
bool decodeFloat(Decoding &decoding);
bool decodeHalf(Decoding &decoding);
bool decodeCompare(Decoding &decoding);
bool decodeConvert(Decoding &decoding);
bool decodeMove(Decoding &decoding);
bool decodeMemory(Decoding &decoding);
bool decodeAtomic(Decoding &decoding);
bool decodeControl(Decoding &decoding);
bool decodeWarpOperation(Decoding &decoding);
bool decodeBarrier(Decoding &decoding);

/// What ends a function that does not say so.
Instruction implicitReturn(uint32_t line);

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_DECODER_H
