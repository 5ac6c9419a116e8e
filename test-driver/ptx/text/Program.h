// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Program.h - A kernel of PTX, decoded -------------------------------===//
//
// A program has the code of an entry function and of all functions that it
// calls. Registers, local memory and parameters of each lie at places of their
// own: there is no recursion. A register is an array over the 32 lanes of a
// warp; a predicate is a mask of lanes. Constants are registers of a second
// bank, which all warps share and none writes. Registers that are written
// before they are read are in a third one, which is not filled for each block.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_PROGRAM_H
#define PIKO_TEST_DRIVER_PTX_PROGRAM_H

#include "ptx/text/Syntax.h"

#include <span>

namespace piko::ptx {

class Warp;
struct Instruction;

inline constexpr uint32_t warpSize = 32;
inline constexpr uint32_t allLanes = ~0u;
/// No instruction.
inline constexpr uint32_t nowhere = ~0u;

/// A register: where it begins in its bank, and the bytes that a lane has.
struct Operand {
  uint32_t offset = 0;
  uint8_t bank = 0;  ///< 0, 2: registers of the warp, 1: constants.
  uint8_t bytes = 0; ///< 0 for a predicate.
};

/// What instructions are counted as.
enum class Class : uint8_t {
  Integer,   ///< Of at most 32 bits.
  Integer64, ///< Which GPUs do in pieces of 32 bits.
  Single,
  Double,
  Special,         ///< Approximations of a multiprocessor's special functions.
  IntegerDivision, ///< And what other divisions and roots are sequences, too.
  SingleDivision,
  DoubleDivision,
  Convert, ///< From or to floats.
  Move,    ///< And selections, addresses of spaces.
  Control,
  LoadGlobal,
  StoreGlobal,
  LoadShared,
  StoreShared,
  LoadLocal,
  StoreLocal,
  LoadGeneric,
  StoreGeneric,
  Parameter, ///< And constant memory.
  Atomic,
  Barrier,
  WarpOperation ///< Shuffles, votes, matches and reductions.
};

/// What an instruction does to the flow of control. A trap ends the launch.
enum class Flow : uint8_t { On, Branch, Table, End, Trap };

/// Runs an instruction for the active lanes of a warp.
using Handler = void (*)(Warp &, const Instruction &);

/// What threads get of a barrier: Instruction::extra.
enum class Reduction : uint8_t { None, Count, All, Any };

/// How soon others see a store.
enum class Order : uint8_t {
  Weak,   ///< At a fence.
  Strong, ///< At once.
  Release ///< At once, with all that was stored before.
};

struct Instruction {
  Handler run = nullptr;
  Operand result, second; ///< second: the other of a pair of results.
  Operand a, b, c;
  Operand guard;
  bool guarded = false, guardNegated = false, negated = false;
  Class counted = Class::Move;
  Space space = Space::Generic;
  Flow flow = Flow::On;
  Order order = Order::Weak; ///< Of a store or an atomic operation.
  uint8_t element = 0;       ///< Bytes, of an access to memory.
  uint8_t count = 0;         ///< Elements, of an access or a vector.
  uint8_t variant = 0;       ///< Of a handler that has several.
  uint32_t line = 0;
  uint32_t target = nowhere;     ///< Of a branch or call.
  uint32_t reconverge = nowhere; ///< Where lanes of a branch meet again.
  uint32_t extra = 0;            ///< Index into a table of the program.
  int64_t offset = 0;            ///< Of an address.
};

/// A register with a value of its own in each thread when a kernel begins.
enum class Special : uint8_t {
  ThreadX,
  ThreadY,
  ThreadZ,
  ThreadsX,
  ThreadsY,
  ThreadsZ,
  BlockX,
  BlockY,
  BlockZ,
  BlocksX,
  BlocksY,
  BlocksZ,
  Lane,
  WarpNumber,
  Warps,
  Multiprocessor,
  Multiprocessors,
  LanesEqual,
  LanesLess,
  LanesLessEqual,
  LanesGreater,
  LanesGreaterEqual
};

struct SpecialRegister {
  Special special;
  Operand place;
};

/// A part of the memory of parameters of a kernel or, for each lane, of calls.
struct Parameter {
  uint32_t offset = 0, size = 0;
};

/// Copies of a lane's parameters of calls: before a call, or after it.
struct Copies {
  struct Copy {
    uint32_t from, to, size;
  };
  std::vector<Copy> list;
};

/// Where the numbers of the registers are that an instruction reads, and
/// after them of those that it writes.
struct Dependences {
  uint32_t first = 0;
  uint16_t read = 0, written = 0;
};

struct Program {
  std::span<const uint32_t> readBy(const Dependences &on) const {
    return std::span(dependenceNumbers).subspan(on.first, on.read);
  }
  std::span<const uint32_t> writtenBy(const Dependences &on) const {
    return std::span(dependenceNumbers).subspan(on.first + on.read, on.written);
  }

  std::string name;
  std::vector<Instruction> code;
  std::vector<uint8_t> constants;
  std::vector<SpecialRegister> specials;
  std::vector<Parameter> parameters;       ///< Of the entry.
  std::vector<std::vector<Operand>> lists; ///< Of vectors.
  std::vector<std::vector<uint32_t>> branchTables;
  std::vector<Copies> calls;
  std::vector<Dependences> dependences; ///< By instruction.
  std::vector<uint32_t> dependenceNumbers;
  uint32_t registerCount = 0;  ///< That dependences number.
  uint32_t filledBytes = 0;    ///< Of a warp: registers of bank 0.
  uint32_t registerBytes = 0;  ///< Of a warp: those of bank 2.
  uint32_t localBytes = 0;     ///< Of a thread.
  uint32_t parameterBytes = 0; ///< Of the entry.
  uint32_t callBytes = 0;      ///< Of a thread: parameters of calls.
  uint32_t sharedBytes = 0;    ///< Of a block, without dynamic ones.
  uint32_t registers = 0;      ///< As declared, in units of 32 bits.
  uint32_t maxRegisters = 0;   ///< Of a thread; 0: not given.
  std::array<uint32_t, 3> maxThreads{}, requiredThreads{}; ///< 0: not given.
};

/// The address of a global or constant variable, by name; 0 if there is none.
class Symbols {
public:
  virtual ~Symbols() = default;
  virtual uint64_t addressOf(std::string_view name) const = 0;
};

/// The program of the entry function \p name. Throws ParseError.
Program decode(const ModuleSyntax &module, std::string_view name,
               const Symbols &symbols);

/// Sets where the branches of the code from \p first on meet again: at the
/// immediate post-dominators of their blocks.
void findReconvergence(Program &program, uint32_t first);

/// Addresses in shared and in local memory begin here: not at 0, so that a null
/// pointer is never valid.
inline constexpr uint64_t sharedStart = 1024, localStart = 4096;
/// Addresses of parameters of calls, in their space, begin here; those of the
/// kernel's at 0.
inline constexpr uint64_t callStart = uint64_t(1) << 32;
/// What shared, local and parameter addresses are as generic ones: no address
/// of the host is like them.
inline constexpr uint64_t sharedWindow = uint64_t(0x5a5a) << 48,
                          localWindow = uint64_t(0x10ca) << 48,
                          parameterWindow = uint64_t(0xa5a5) << 48,
                          windowMask = uint64_t(0xffff) << 48;

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_PROGRAM_H
