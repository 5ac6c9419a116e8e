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
  auto symbols = orc::DynamicLibrarySearchGenerator::GetForCurrentProcess(
      (*jit)->getDataLayout().getGlobalPrefix());
  if (!symbols)
    return symbols.takeError();
  orc::JITDylib &library = (*jit)->getMainJITDylib();
  library.addGenerator(std::move(*symbols));
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
