// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Machine code in this process.

#include "Piko/Target/JIT.h"

#include "llvm/ExecutionEngine/Orc/ExecutionUtils.h"
#include "llvm/Support/TargetSelect.h"

using namespace llvm;
using namespace piko;

Sanitizer JITCode::getSanitizer() {
  StringRef names = PIKO_SANITIZE;
  return names.contains("address")  ? Sanitizer::Address
         : names.contains("thread") ? Sanitizer::Thread
                                    : Sanitizer::None;
}

Expected<std::unique_ptr<JITCode>> JITCode::load(ArrayRef<StringRef> objects) {
  InitializeNativeTarget();
  InitializeNativeTargetAsmPrinter();
  auto jit = orc::LLJITBuilder().create();
  if (!jit)
    return jit.takeError();
  auto process = orc::DynamicLibrarySearchGenerator::GetForCurrentProcess(
      (*jit)->getDataLayout().getGlobalPrefix());
  if (!process)
    return process.takeError();
  orc::JITDylib &library = (*jit)->getMainJITDylib();
  library.addGenerator(std::move(*process));
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
