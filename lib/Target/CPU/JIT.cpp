// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Machine code in this process.

#include "Piko/Target/JIT.h"

#include "llvm/ExecutionEngine/Orc/ExecutionUtils.h"
#include "llvm/ExecutionEngine/Orc/MapperJITLinkMemoryManager.h"
#include "llvm/ExecutionEngine/Orc/MemoryMapper.h"
#include "llvm/ExecutionEngine/Orc/SelfExecutorProcessControl.h"
#include "llvm/Support/Process.h"
#include "llvm/Support/TargetSelect.h"

#include "pikort/pikort.h"

#include <dlfcn.h>

using namespace llvm;
using namespace piko;

Sanitizer JITCode::getSanitizer() {
  StringRef names = PIKO_SANITIZE;
  return names.contains("address")  ? Sanitizer::Address
         : names.contains("thread") ? Sanitizer::Thread
                                    : Sanitizer::None;
}

/// One range of addresses for all objects: each may refer to what another one
/// has, within 2 GB, and the system gives such ranges where it likes.
static Expected<std::unique_ptr<orc::ExecutorProcessControl>>
createProcess(ArrayRef<StringRef> objects) {
  // What links them, and variables that take no room in an object.
  constexpr size_t others = 1 << 20, factor = 4;
  size_t bytes = others;
  for (StringRef object : objects)
    bytes += factor * object.size();
  auto memory = orc::MapperJITLinkMemoryManager::CreateWithMapper<
      orc::InProcessMemoryMapper>(
      alignTo(bytes, sys::Process::getPageSizeEstimate()));
  if (!memory)
    return memory.takeError();
  return orc::SelfExecutorProcessControl::Create(nullptr, nullptr,
                                                 std::move(*memory));
}

/// The runtime that this compiler is linked with, and all that it is linked
/// with. A host may have loaded them for itself alone, as Python loads modules:
/// then the process does not show them. It stays loaded.
static sys::DynamicLibrary findRuntime() {
  Dl_info runtime;
  void *handle = nullptr;
  if (dladdr(reinterpret_cast<void *>(&pikort_create), &runtime))
    handle = dlopen(runtime.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  return handle ? sys::DynamicLibrary(handle) : sys::DynamicLibrary();
}

/// Finds what code calls: the runtime's functions in this compiler's runtime,
/// all others where the process would, or else where the runtime does.
static Error addSymbols(orc::JITDylib &library, char prefix) {
  static const sys::DynamicLibrary runtime = findRuntime();
  auto search = [&](auto &&...which) {
    library.addGenerator(std::make_unique<orc::DynamicLibrarySearchGenerator>(
        runtime, prefix, which...));
  };
  if (runtime.isValid())
    search([](const orc::SymbolStringPtr &name) {
      StringRef text = *name;
      return text.contains("pikoir_") || text.contains("pikort_");
    });
  auto process =
      orc::DynamicLibrarySearchGenerator::GetForCurrentProcess(prefix);
  if (!process)
    return process.takeError();
  library.addGenerator(std::move(*process));
  if (runtime.isValid())
    search();
  return Error::success();
}

Expected<std::unique_ptr<JITCode>> JITCode::load(ArrayRef<StringRef> objects) {
  InitializeNativeTarget();
  InitializeNativeTargetAsmPrinter();
  auto process = createProcess(objects);
  if (!process)
    return process.takeError();
  auto jit = orc::LLJITBuilder()
                 .setExecutorProcessControl(std::move(*process))
                 .create();
  if (!jit)
    return jit.takeError();
  orc::JITDylib &library = (*jit)->getMainJITDylib();
  if (Error error =
          addSymbols(library, (*jit)->getDataLayout().getGlobalPrefix()))
    return error;
  for (StringRef object : objects) {
    if (object.empty())
      continue;
    if (Error error =
            (*jit)->addObjectFile(MemoryBuffer::getMemBufferCopy(object)))
      return error;
  }
  if (Error error = (*jit)->initialize(library))
    return error;
  auto code = std::make_unique<JITCode>();
  code->jit = std::move(*jit);
  return code;
}
