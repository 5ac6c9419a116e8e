// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Syntax.h - A module of PTX as it is written ------------------------===//
//
// What the parser gives, and the decoder (Decoder.h) turns into what runs. No
// opcode is looked at here.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_SYNTAX_H
#define PIKO_TEST_DRIVER_PTX_SYNTAX_H

#include "ptx/text/Type.h"

#include <array>
#include <map>
#include <vector>

namespace piko::ptx {

/// An operand of an instruction.
struct Argument {
  enum Kind : uint8_t {
    Register,  ///< Or a special register: name.
    Symbol,    ///< A variable, label or function: name, plus value.
    Immediate, ///< value
    Float,     ///< value has the bits, of which there are 32 or 64: width.
    Sink,      ///< _
    Vector,    ///< {parts}
    Pair,      ///< parts[0]|parts[1]
    Address,   ///< [parts[0] + value]
    List       ///< (parts), of a call
  };
  Kind kind = Immediate;
  bool negated = false; ///< !, of a predicate.
  uint8_t width = 0;
  int64_t value = 0;
  std::string name;
  std::vector<Argument> parts;
};

struct Statement {
  uint32_t line = 0;
  std::string_view opcode; ///< Of the module's text.
  std::string guard;       ///< Register of a predicate; empty if none.
  bool guardNegated = false;
  std::vector<Argument> arguments;
};

struct Variable {
  /// What an initialiser says is an address.
  struct Pointer {
    uint64_t offset;
    std::string symbol;
    int64_t addend;
  };

  std::string name;
  uint32_t line = 0;
  Space space = Space::Global;
  bool external = false;     ///< .extern: of another module, or dynamic.
  uint32_t alignment = 1;    ///< In bytes.
  uint64_t size = 0;         ///< In bytes.
  std::vector<uint8_t> data; ///< At most size bytes; zeros follow.
  std::vector<Pointer> pointers;
};

/// Registers %r0 to %r(count-1), or the one register %r where count is 0.
struct RegisterFamily {
  std::string prefix;
  Type type;
  uint32_t count = 0;
};

struct FunctionSyntax {
  std::string name;
  uint32_t line = 0;
  bool entry = false, defined = false;
  std::vector<Variable> parameters, results;
  std::vector<Variable> variables; ///< Of the body; names are unique.
  std::vector<RegisterFamily> registers;
  std::vector<Statement> statements;
  std::map<std::string, size_t, std::less<>> labels; ///< To statements.
  std::map<std::string, std::vector<std::string>, std::less<>> branchTargets;
  /// Of .maxntid and .reqntid, each 0 where not given.
  std::array<uint32_t, 3> maxThreads{}, requiredThreads{};
  uint32_t maxRegisters = 0;
};

struct ModuleSyntax {
  uint32_t versionMajor = 0, versionMinor = 0;
  uint32_t target = 0; ///< 90 for sm_90.
  std::vector<Variable> variables;
  std::vector<FunctionSyntax> functions;
};

/// \p text must outlive what is returned. Throws ParseError.
ModuleSyntax parseModule(std::string_view text);

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_SYNTAX_H
