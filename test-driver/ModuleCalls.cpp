// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ModuleCalls.cpp - Modules of the driver for tests ------------------===//

#include "State.h"

#include <algorithm>
#include <cstring>
#include <elf.h>

using namespace piko::testdriver;
using namespace piko::cuda;
namespace ptx = piko::ptx;
using piko::ptx::ParseError;
using piko::ptx::Space;

namespace {

/// The newest PTX that is taken: that of CUDA 12.9.
constexpr uint32_t newestMajor = 8, newestMinor = 8;
constexpr uint32_t mostShared = 48 << 10;
constexpr int mostThreads = 1024, mostThreadsOfProcessor = 2048,
              mostBlocksOfProcessor = 32, mostRegisters = 255,
              registersOfProcessor = 65536;

/// Puts texts into the buffers of cuModuleLoadDataEx's options.
class Log {
public:
  Log(unsigned count, const CUjit_option *options, void **values) {
    for (unsigned i = 0; i < count; ++i) {
      if (options[i] == CU_JIT_ERROR_LOG_BUFFER)
        errors = static_cast<char *>(values[i]);
      if (options[i] == CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES)
        errorsSize = &values[i];
      if (options[i] == CU_JIT_INFO_LOG_BUFFER && values[i])
        *static_cast<char *>(values[i]) = 0;
      if (options[i] == CU_JIT_INFO_LOG_BUFFER_SIZE_BYTES)
        values[i] = nullptr;
    }
    // The size is given, and then that of the text.
    room = errorsSize ? reinterpret_cast<uintptr_t>(*errorsSize) : 0;
    write("");
  }

  void write(const std::string &text) const {
    if (!errors || !room)
      return;
    size_t size = std::min<size_t>(text.size(), room - 1);
    std::memcpy(errors, text.data(), size);
    errors[size] = 0;
    *errorsSize = reinterpret_cast<void *>(size);
  }

private:
  char *errors = nullptr;
  void **errorsSize = nullptr;
  uintptr_t room = 0;
};

class Loader {
public:
  Loader(Context &context, const char *source)
      : context(context), module(std::make_unique<Module>()) {
    module->source = source;
  }
  Loader(const Loader &) = delete;
  Loader &operator=(const Loader &) = delete;
  ~Loader() {
    if (!module)
      return;
    for (const auto &[name, address] : module->variables)
      context.memory.release(address);
    for (const auto &[name, function] : module->functions)
      context.functions.erase(function);
  }

  /// Throws ParseError. Returns an error for what is valid but cannot run.
  CUresult load();
  CUmodule keep() {
    auto handle = state().newHandle<CUmodule>();
    context.modules[handle] = std::move(module);
    return handle;
  }

private:
  void placeVariables();
  void fillPointers() const;
  void decodeFunctions();

  Context &context;
  std::unique_ptr<Module> module;
};

CUresult Loader::load() {
  module->syntax = ptx::parseModule(module->source);
  const ptx::ModuleSyntax &syntax = module->syntax;
  if (std::pair(syntax.versionMajor, syntax.versionMinor) >
      std::pair(newestMajor, newestMinor))
    return CUDA_ERROR_UNSUPPORTED_PTX_VERSION;
  if (syntax.target > static_cast<uint32_t>(state().capability))
    return CUDA_ERROR_NO_BINARY_FOR_GPU;
  placeVariables();
  fillPointers();
  decodeFunctions();
  return CUDA_SUCCESS;
}

void Loader::placeVariables() {
  for (const ptx::Variable &variable : module->syntax.variables) {
    if (variable.space == Space::Shared)
      continue;
    if (variable.external)
      throw ParseError(variable.line,
                       "expected a definition of '" + variable.name + "'");
    const Allocation *made = context.memory.allocate(
        AllocationKind::Module, std::max<uint64_t>(variable.size, 1));
    if (!made)
      throw ParseError(variable.line, "no memory for '" + variable.name + "'");
    std::memset(made->memory, 0, made->bytes);
    std::copy(variable.data.begin(), variable.data.end(), made->memory);
    module->variables[variable.name] = made->begin;
    if (variable.space == Space::Const)
      module->constantBytes += variable.size;
  }
}

void Loader::fillPointers() const {
  for (const ptx::Variable &variable : module->syntax.variables)
    for (const ptx::Variable::Pointer &pointer : variable.pointers) {
      uint64_t address = module->addressOf(pointer.symbol);
      if (!address)
        throw ParseError(variable.line,
                         "expected a variable '" + pointer.symbol + "'");
      address += static_cast<uint64_t>(pointer.addend);
      std::memcpy(reinterpret_cast<uint8_t *>(module->addressOf(variable.name) +
                                              pointer.offset),
                  &address, sizeof(address));
    }
}

void Loader::decodeFunctions() {
  for (const ptx::FunctionSyntax &syntax : module->syntax.functions) {
    if (!syntax.entry)
      continue;
    Function function;
    function.module = module.get();
    function.program = ptx::decode(module->syntax, syntax.name, *module);
    if (function.program.sharedBytes > mostShared)
      throw ParseError(syntax.line,
                       "expected at most " + std::to_string(mostShared) +
                           " bytes of shared memory, but '" + syntax.name +
                           "' has " +
                           std::to_string(function.program.sharedBytes));
    auto handle = state().newHandle<CUfunction>();
    context.functions[handle] = std::move(function);
    module->functions[syntax.name] = handle;
  }
}

/// What is wrong with an image that is not the text of PTX; a cubin is for no
/// device here, whichever chip it is for.
std::pair<CUresult, std::string> refuse(const char *image) {
  Elf64_Ehdr header;
  constexpr uint16_t cuda = 190;
  if (std::memcmp(image, ELFMAG, SELFMAG) != 0)
    return {CUDA_ERROR_INVALID_IMAGE, "expected the text of PTX"};
  std::memcpy(&header, image, sizeof(header));
  if (header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_machine != cuda)
    return {CUDA_ERROR_INVALID_IMAGE, "expected a cubin, but got another ELF"};
  // Toolkits from 13 on have the chip in another byte.
  uint32_t chip = header.e_flags >> (header.e_ident[EI_ABIVERSION] < 8 ? 0 : 8);
  return {CUDA_ERROR_NO_BINARY_FOR_GPU, "a cubin for sm_" +
                                            std::to_string(chip & 0xff) +
                                            ", and this device runs PTX"};
}

bool isText(const char *image) {
  return *image && std::memcmp(image, ELFMAG, SELFMAG) != 0 &&
         std::memcmp(image, "\x50\xed\x55\xba", 4) != 0;
}

} // namespace

CUresult piko::cuda::cuModuleLoadDataEx(CUmodule *result, const void *image,
                                        unsigned count, CUjit_option *options,
                                        void **values) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  if (!result || !image || (count && (!options || !values)))
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  const Log log(count, options, values);
  const char *source = static_cast<const char *>(image);
  if (!isText(source)) {
    auto [error, text] = refuse(source);
    return call.fail(error, text);
  }
  try {
    Loader loader(call.context(), source);
    if (CUresult error = loader.load())
      return call.fail(error, "");
    *result = loader.keep();
    return CUDA_SUCCESS;
  } catch (const ParseError &error) {
    log.write(error.what());
    return call.fail(CUDA_ERROR_INVALID_PTX, error.what());
  }
}

CUresult piko::cuda::cuModuleUnload(CUmodule handle) {
  Call call(__func__, Needs::NoCapture);
  if (CUresult error = call.refused())
    return error;
  if (CUresult error = call.finishAll())
    return error;
  Context &context = call.context();
  auto found = context.modules.find(handle);
  if (found == context.modules.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no loaded module");
  for (const auto &[name, address] : found->second->variables)
    context.memory.release(address);
  for (const auto &[name, function] : found->second->functions)
    context.functions.erase(function);
  context.modules.erase(found);
  return CUDA_SUCCESS;
}

CUresult piko::cuda::cuModuleGetFunction(CUfunction *function, CUmodule module,
                                         const char *name) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  if (!function || !name)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  auto found = call.context().modules.find(module);
  if (found == call.context().modules.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no loaded module");
  const auto &functions = found->second->functions;
  auto named = functions.find(std::string_view(name));
  if (named == functions.end())
    return call.fail(CUDA_ERROR_NOT_FOUND,
                     "expected a kernel '" + std::string(name) + "'");
  *function = named->second;
  return CUDA_SUCCESS;
}

static int registersOf(const piko::ptx::Program &program) {
  // What a compiler would need is less than what is declared.
  const int most =
      program.maxRegisters
          ? std::min(static_cast<int>(program.maxRegisters), mostRegisters)
          : mostRegisters;
  return std::clamp(static_cast<int>(program.registers), std::min(16, most),
                    most);
}

static int threadsOf(const piko::ptx::Program &program) {
  const auto &limit =
      program.requiredThreads[0] ? program.requiredThreads : program.maxThreads;
  return limit[0] ? static_cast<int>(limit[0] * limit[1] * limit[2])
                  : mostThreads;
}

CUresult piko::cuda::cuFuncGetAttribute(int *value,
                                        CUfunction_attribute attribute,
                                        CUfunction handle) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().functions.find(handle);
  if (found == call.context().functions.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no function of a module");
  if (!value)
    return call.fail(CUDA_ERROR_INVALID_VALUE, "null");
  found->second.loaded = true;
  const ptx::Program &program = found->second.program;
  const Module &module = *found->second.module;
  switch (attribute) {
  case CU_FUNC_ATTRIBUTE_MAX_THREADS_PER_BLOCK:
    *value = threadsOf(program);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES:
    *value = static_cast<int>(program.sharedBytes);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_CONST_SIZE_BYTES:
    *value = static_cast<int>(module.constantBytes);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES:
    *value = static_cast<int>(program.localBytes);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_NUM_REGS:
    *value = registersOf(program);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_PTX_VERSION:
    *value = static_cast<int>(10 * module.syntax.versionMajor +
                              module.syntax.versionMinor);
    return CUDA_SUCCESS;
  case CU_FUNC_ATTRIBUTE_BINARY_VERSION:
    *value = state().capability;
    return CUDA_SUCCESS;
  }
  return call.fail(CUDA_ERROR_INVALID_VALUE,
                   "attribute " + std::to_string(attribute));
}

/// Bytes of shared memory that a multiprocessor has.
static size_t sharedOfProcessor() {
  const int capability = state().capability;
  const size_t kilobytes = capability >= 90 && capability < 120   ? 228
                           : capability == 80 || capability == 87 ? 164
                                                                  : 100;
  return kilobytes << 10;
}

int piko::testdriver::residentBlocks(const ptx::Program &program, int threads,
                                     size_t dynamicSharedBytes) {
  constexpr int usual = 64;
  const int registers = program.maxRegisters
                            ? registersOf(program)
                            : std::min(registersOf(program), usual);
  const int warps = (threads + 31) / 32;
  const size_t shared = program.sharedBytes + dynamicSharedBytes;
  int blocks =
      std::min({mostBlocksOfProcessor, mostThreadsOfProcessor / (32 * warps),
                registersOfProcessor / (32 * warps * registers)});
  if (shared)
    blocks = std::min(blocks, static_cast<int>(sharedOfProcessor() / shared));
  return blocks;
}

CUresult piko::cuda::cuOccupancyMaxActiveBlocksPerMultiprocessor(
    int *blocks, CUfunction handle, int threads, size_t sharedBytes) {
  Call call(__func__, Needs::Context);
  if (CUresult error = call.refused())
    return error;
  auto found = call.context().functions.find(handle);
  if (found == call.context().functions.end())
    return call.fail(CUDA_ERROR_INVALID_HANDLE, "no function of a module");
  found->second.loaded = true;
  const ptx::Program &program = found->second.program;
  if (!blocks || threads <= 0 || threads > threadsOf(program))
    return call.fail(CUDA_ERROR_INVALID_VALUE,
                     std::to_string(threads) + " threads");
  *blocks = residentBlocks(program, threads, sharedBytes);
  return CUDA_SUCCESS;
}
