// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Decoder.cpp - Programs of kernels ----------------------------------===//
//
// 1. The entry function and those that it calls, one after the other, get
//    places for their variables and parameters.
// 2. Statements become instructions; registers and constants get their places
//    where they are first used, and give them back where a basic block knows of
//    their last use.
// 3. Labels and functions become numbers of instructions.
// 4. Branches learn where their lanes meet again.
//
//===----------------------------------------------------------------------===//

#include "ptx/text/Decoder.h"
#include "ptx/memory/Locals.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

using namespace piko::ptx;

namespace {

/// Registers and constants begin at multiples of it: whole vectors.
constexpr uint32_t placeAlignment = 64;

constexpr std::pair<std::string_view, Special> specialNames[] = {
    {"%tid.x", Special::ThreadX},
    {"%tid.y", Special::ThreadY},
    {"%tid.z", Special::ThreadZ},
    {"%ntid.x", Special::ThreadsX},
    {"%ntid.y", Special::ThreadsY},
    {"%ntid.z", Special::ThreadsZ},
    {"%ctaid.x", Special::BlockX},
    {"%ctaid.y", Special::BlockY},
    {"%ctaid.z", Special::BlockZ},
    {"%nctaid.x", Special::BlocksX},
    {"%nctaid.y", Special::BlocksY},
    {"%nctaid.z", Special::BlocksZ},
    {"%laneid", Special::Lane},
    {"%warpid", Special::WarpNumber},
    {"%nwarpid", Special::Warps},
    {"%smid", Special::Multiprocessor},
    {"%nsmid", Special::Multiprocessors},
    {"%lanemask_eq", Special::LanesEqual},
    {"%lanemask_lt", Special::LanesLess},
    {"%lanemask_le", Special::LanesLessEqual},
    {"%lanemask_gt", Special::LanesGreater},
    {"%lanemask_ge", Special::LanesGreaterEqual}};

uint64_t roundUp(uint64_t value, uint64_t multiple) {
  return (value + multiple - 1) / multiple * multiple;
}

class ProgramDecoder : public Scope {
public:
  ProgramDecoder(const ModuleSyntax &module, const Symbols &symbols)
      : module(module), symbols(symbols) {}
  Program decode(std::string_view entry);

  Operand registerOf(const std::string &name, Type *type) override;
  Operand scratch(uint8_t bytes) override { return place(bytes); }
  Operand constant(uint64_t bits, uint8_t bytes) override;
  uint64_t addressOf(const std::string &symbol, Space &space) override;
  uint32_t addList(std::vector<Operand> list) override;
  uint32_t addCopies(Copies copies) override;
  const FunctionSyntax &functionOf(const std::string &name) override;
  Parameter parameterOf(const FunctionSyntax &function,
                        const Variable &variable) override;

private:
  struct Register {
    Type type;
    Operand place;
  };
  struct Address {
    Space space;
    uint64_t value;
  };
  /// Of a function that the program has.
  struct Place {
    uint32_t first = 0;
    std::map<std::string, Address, std::less<>> variables;
  };

  void placeModuleVariables();
  Place &placeFunction(const FunctionSyntax &function);
  void decodeFunction(const FunctionSyntax &function);
  void decodeStatement(const Statement &statement);
  void linkLabels(const FunctionSyntax &function,
                  const std::vector<uint32_t> &starts);
  void linkCalls();
  void checkRecursion(const std::string &function, int depth) const;
  const Type *typeOf(std::string_view name) const;
  Operand place(uint8_t bytes, bool isFilled = true);
  Operand placeOf(const std::string &name, uint8_t bytes);
  void freeLocals(size_t statement);
  uint64_t allocate(uint64_t &end, const Variable &variable);
  void append(const Instruction &instruction,
              const std::vector<Operand> &read = {},
              const std::vector<Operand> &written = {});

  const ModuleSyntax &module;
  const Symbols &symbols;
  Program program;
  std::map<std::string, Address, std::less<>> moduleVariables;
  std::map<std::string, Place, std::less<>> places;
  std::map<std::string, std::vector<std::string>> callGraph;
  std::vector<const FunctionSyntax *> pending;
  std::map<std::pair<uint64_t, uint8_t>, Operand> constants;
  /// Of registers, by bank and offset.
  std::map<std::pair<uint8_t, uint32_t>, uint32_t> numbers;
  uint64_t sharedEnd = sharedStart, localEnd = localStart, callEnd = callStart;

  // Of the function that is decoded.
  const FunctionSyntax *current = nullptr;
  std::map<std::string, Register, std::less<>> registers;
  std::optional<BlockLocals> locals;
  std::optional<WrittenFirst> writtenFirst;
  /// Places of block locals that are over. By width: lanes that wait in a block
  /// while others run elsewhere keep theirs.
  std::map<uint8_t, std::vector<Operand>> free;
  std::map<uint32_t, std::string> labels, tables; ///< Of instructions.
  std::map<uint32_t, std::string> callees;        ///< Of all functions.
};

} // namespace

uint64_t ProgramDecoder::allocate(uint64_t &end, const Variable &variable) {
  uint64_t begin = roundUp(end, variable.alignment);
  end = begin + variable.size;
  return begin;
}

void ProgramDecoder::placeModuleVariables() {
  for (const Variable &variable : module.variables)
    if (variable.space == Space::Shared && !variable.external)
      moduleVariables[variable.name] = {Space::Shared,
                                        allocate(sharedEnd, variable)};
}

ProgramDecoder::Place &
ProgramDecoder::placeFunction(const FunctionSyntax &function) {
  auto [found, isNew] = places.try_emplace(function.name);
  Place &place = found->second;
  if (!isNew)
    return place;
  pending.push_back(&function);
  uint64_t parameterEnd = 0;
  uint64_t &end = function.entry ? parameterEnd : callEnd;
  for (const auto *list : {&function.parameters, &function.results})
    for (const Variable &variable : *list) {
      uint64_t begin = allocate(end, variable);
      place.variables[variable.name] = {Space::Param, begin};
      if (function.entry)
        program.parameters.push_back({static_cast<uint32_t>(begin),
                                      static_cast<uint32_t>(variable.size)});
    }
  if (function.entry)
    program.parameterBytes = static_cast<uint32_t>(parameterEnd);
  for (const Variable &variable : function.variables) {
    uint64_t *region = variable.space == Space::Shared  ? &sharedEnd
                       : variable.space == Space::Local ? &localEnd
                       : variable.space == Space::Param ? &callEnd
                                                        : nullptr;
    if (!region)
      throw ParseError(variable.line, std::string("expected no variable in ") +
                                          nameOf(variable.space) +
                                          " memory in a function");
    place.variables[variable.name] = {variable.space,
                                      allocate(*region, variable)};
  }
  for (const RegisterFamily &family : function.registers)
    program.registers +=
        std::max(family.count, 1u) * (family.type.isPredicate() ? 0
                                      : family.type.bits == 64  ? 2
                                                                : 1);
  return place;
}

Operand ProgramDecoder::place(uint8_t bytes, bool isFilled) {
  Operand operand;
  operand.bytes = bytes;
  operand.bank = isFilled ? 0 : 2;
  uint32_t &end = isFilled ? program.filledBytes : program.registerBytes;
  operand.offset = end;
  end += static_cast<uint32_t>(
      roundUp(bytes ? bytes * warpSize : sizeof(uint32_t), placeAlignment));
  return operand;
}

Operand ProgramDecoder::placeOf(const std::string &name, uint8_t bytes) {
  std::vector<Operand> &unused = free[bytes];
  if (unused.empty() || !locals->contains(name))
    return place(bytes, !writtenFirst->contains(name));
  Operand operand = unused.back();
  unused.pop_back();
  return operand;
}

void ProgramDecoder::freeLocals(size_t statement) {
  for (std::string_view name : locals->endingAt(statement))
    if (auto found = registers.find(name); found != registers.end())
      free[found->second.place.bytes].push_back(found->second.place);
}

const Type *ProgramDecoder::typeOf(std::string_view name) const {
  for (const RegisterFamily &family : current->registers) {
    if (!family.count) {
      if (name == family.prefix)
        return &family.type;
      continue;
    }
    if (!name.starts_with(family.prefix) || name.size() == family.prefix.size())
      continue;
    uint64_t number = 0;
    std::string_view digits = name.substr(family.prefix.size());
    if (digits.size() > 9 ||
        digits.find_first_not_of("0123456789") != digits.npos)
      continue;
    for (char digit : digits)
      number = number * 10 + static_cast<uint64_t>(digit - '0');
    if (number < family.count)
      return &family.type;
  }
  return nullptr;
}

Operand ProgramDecoder::registerOf(const std::string &name, Type *type) {
  if (auto found = registers.find(name); found != registers.end()) {
    *type = found->second.type;
    return found->second.place;
  }
  Register made;
  if (const Type *declared = typeOf(name)) {
    made.type = *declared;
    made.place = placeOf(
        name, declared->isPredicate()
                  ? 0
                  : static_cast<uint8_t>(std::max(declared->bytes(), 2u)));
  } else if (name == "%carry") { // Of add.cc, in no program's text.
    made.type = {Kind::Predicate, 1};
    made.place = place(0);
  } else {
    const auto *special =
        std::find_if(std::begin(specialNames), std::end(specialNames),
                     [&](const auto &it) { return it.first == name; });
    if (special == std::end(specialNames))
      throw ParseError(current->line, "expected a register that is declared "
                                      "or special, but got '" +
                                          name + "' in '" + current->name +
                                          "'");
    made.type = {Kind::Unsigned, 32};
    made.place = place(4);
    program.specials.push_back({special->second, made.place});
  }
  registers[name] = made;
  *type = made.type;
  return made.place;
}

Operand ProgramDecoder::constant(uint64_t bits, uint8_t bytes) {
  if (bytes < 8)
    bits &= bytes ? (uint64_t(1) << 8 * bytes) - 1 : uint64_t(allLanes);
  auto [found, isNew] = constants.try_emplace({bits, bytes});
  Operand &operand = found->second;
  if (!isNew)
    return operand;
  operand.bank = 1;
  operand.bytes = bytes;
  operand.offset = static_cast<uint32_t>(program.constants.size());
  uint32_t width = bytes ? bytes : 4, count = bytes ? warpSize : 1;
  program.constants.resize(
      roundUp(operand.offset + width * count, placeAlignment));
  for (uint32_t lane = 0; lane < count; ++lane)
    std::memcpy(&program.constants[operand.offset + lane * width], &bits,
                width);
  return operand;
}

uint64_t ProgramDecoder::addressOf(const std::string &symbol, Space &space) {
  const Place &place = places.find(current->name)->second;
  for (const auto *variables :
       {&place.variables, &std::as_const(moduleVariables)})
    if (auto found = variables->find(symbol); found != variables->end()) {
      space = found->second.space;
      return found->second.value;
    }
  if (uint64_t address = symbols.addressOf(symbol)) {
    space = Space::Global;
    return address;
  }
  throw ParseError(current->line, "expected a variable that is declared, but "
                                  "got '" +
                                      symbol + "' in '" + current->name + "'");
}

uint32_t ProgramDecoder::addList(std::vector<Operand> list) {
  program.lists.push_back(std::move(list));
  return static_cast<uint32_t>(program.lists.size()) - 1;
}

uint32_t ProgramDecoder::addCopies(Copies copies) {
  program.calls.push_back(std::move(copies));
  return static_cast<uint32_t>(program.calls.size()) - 1;
}

const FunctionSyntax &ProgramDecoder::functionOf(const std::string &name) {
  for (const FunctionSyntax &function : module.functions)
    if (function.name == name && !function.entry) {
      callGraph[current->name].push_back(name);
      placeFunction(function);
      return function;
    }
  throw ParseError(current->line, "expected a function that the module "
                                  "defines, but got '" +
                                      name + "' in '" + current->name + "'");
}

Parameter ProgramDecoder::parameterOf(const FunctionSyntax &function,
                                      const Variable &variable) {
  uint64_t begin = places.find(function.name)
                       ->second.variables.find(variable.name)
                       ->second.value;
  return {static_cast<uint32_t>(begin - callStart),
          static_cast<uint32_t>(variable.size)};
}

void ProgramDecoder::decodeStatement(const Statement &statement) {
  static constexpr bool (*groups[])(Decoding &) = {
      decodeMove,   decodeInteger, decodeLogic,   decodeFloat,
      decodeHalf,   decodeCompare, decodeConvert, decodeMemory,
      decodeAtomic, decodeControl, decodeBarrier, decodeWarpOperation};
  Decoding decoding(statement, *this);
  if (std::none_of(std::begin(groups), std::end(groups),
                   [&](auto group) { return group(decoding); }))
    decoding.fail("expected an instruction that is known");
  auto pc = static_cast<uint32_t>(program.code.size());
  if (!decoding.branchLabel.empty())
    labels[pc] = decoding.branchLabel;
  if (!decoding.branchTable.empty())
    tables[pc] = decoding.branchTable;
  if (!decoding.callee.empty())
    callees[pc] = decoding.callee;
  append(decoding.it, decoding.read, decoding.written);
  if (decoding.after.run)
    append(decoding.after);
}

void ProgramDecoder::append(const Instruction &instruction,
                            const std::vector<Operand> &read,
                            const std::vector<Operand> &written) {
  program.dependences.push_back(
      {static_cast<uint32_t>(program.dependenceNumbers.size()),
       static_cast<uint16_t>(read.size()),
       static_cast<uint16_t>(written.size())});
  for (const auto *operands : {&read, &written})
    for (const Operand &it : *operands) {
      auto [found, isNew] =
          numbers.try_emplace({it.bank, it.offset}, program.registerCount);
      program.registerCount += isNew;
      program.dependenceNumbers.push_back(found->second);
    }
  program.code.push_back(instruction);
}

void ProgramDecoder::linkLabels(const FunctionSyntax &function,
                                const std::vector<uint32_t> &starts) {
  auto find = [&](uint32_t pc, const std::string &label) {
    auto found = function.labels.find(label);
    if (found == function.labels.end())
      throw ParseError(program.code[pc].line,
                       "expected a label that is there, but got '" + label +
                           "'");
    return starts[found->second];
  };
  for (const auto &[pc, label] : labels)
    program.code[pc].target = find(pc, label);
  for (const auto &[pc, name] : tables) {
    auto found = function.branchTargets.find(name);
    if (found == function.branchTargets.end())
      throw ParseError(program.code[pc].line,
                       "expected branch targets, but got '" + name + "'");
    std::vector<uint32_t> targets;
    for (const std::string &label : found->second)
      targets.push_back(find(pc, label));
    program.code[pc].extra = static_cast<uint32_t>(program.branchTables.size());
    program.branchTables.push_back(std::move(targets));
  }
}

void ProgramDecoder::decodeFunction(const FunctionSyntax &function) {
  current = &function;
  registers.clear();
  locals.emplace(function);
  writtenFirst.emplace(function);
  free.clear();
  labels.clear();
  tables.clear();
  auto first = static_cast<uint32_t>(program.code.size());
  places.find(function.name)->second.first = first;
  std::vector<uint32_t> starts;
  for (size_t i = 0; i < function.statements.size(); ++i) {
    starts.push_back(static_cast<uint32_t>(program.code.size()));
    decodeStatement(function.statements[i]);
    freeLocals(i);
  }
  starts.push_back(static_cast<uint32_t>(program.code.size()));
  append(implicitReturn(function.statements.empty()
                            ? function.line
                            : function.statements.back().line));
  linkLabels(function, starts);
  findReconvergence(program, first);
}

void ProgramDecoder::checkRecursion(const std::string &function,
                                    int depth) const {
  if (depth > static_cast<int>(places.size()))
    throw ParseError(current->line, "expected no recursion, but got that of '" +
                                        function + "'");
  if (auto found = callGraph.find(function); found != callGraph.end())
    for (const std::string &callee : found->second)
      checkRecursion(callee, depth + 1);
}

void ProgramDecoder::linkCalls() {
  for (const auto &[pc, callee] : callees)
    program.code[pc].target = places.find(callee)->second.first;
}

Program ProgramDecoder::decode(std::string_view name) {
  auto entry = std::find_if(
      module.functions.begin(), module.functions.end(),
      [&](const FunctionSyntax &it) { return it.entry && it.name == name; });
  if (entry == module.functions.end())
    throw ParseError(1, "expected an entry '" + std::string(name) + "'");
  program.name = entry->name;
  program.maxRegisters = entry->maxRegisters;
  program.maxThreads = entry->maxThreads;
  program.requiredThreads = entry->requiredThreads;
  placeModuleVariables();
  placeFunction(*entry);
  while (!pending.empty()) {
    const FunctionSyntax *function = pending.back();
    pending.pop_back();
    decodeFunction(*function);
  }
  checkRecursion(entry->name, 0);
  linkCalls();
  program.sharedBytes = static_cast<uint32_t>(sharedEnd - sharedStart);
  program.localBytes = static_cast<uint32_t>(localEnd - localStart);
  program.callBytes = static_cast<uint32_t>(callEnd - callStart);
  return std::move(program);
}

Program piko::ptx::decode(const ModuleSyntax &module, std::string_view name,
                          const Symbols &symbols) {
  return ProgramDecoder(module, symbols).decode(name);
}
