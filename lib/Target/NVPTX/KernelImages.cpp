// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// PTX and cubins as constants of the host's module.

#include "Piko/Target/KernelImages.h"
#include "Piko/Analysis/TargetModel.h"

#include "KernelReports.h"

#include "Piko/Target/Assembler.h"
#include "Piko/Target/KernelResources.h"
#include "Piko/Target/PTX.h"

#include "llvm/IR/Constants.h"

using namespace llvm;
using namespace piko;

/// A cubin of `ptx` for a chip; nothing where there can be none.
static std::optional<std::string>
makeCubin(StringRef assembler, const Module &kernels, StringRef ptx,
          StringRef chip, function_ref<void(const MissingCubin &)> report) {
  if (assembler.empty()) {
    report({chip.str(), "no ptxas was found", false});
    return std::nullopt;
  }
  auto assembled = assembleKernels(assembler, kernels, ptx, chip);
  if (assembled)
    return std::move(assembled->cubin);
  std::string reason = toString(assembled.takeError());
  if (knowsChip(assembler, chip))
    report({chip.str(), reason, true});
  else
    report({chip.str(), "the ptxas that was found does not know it", false});
  return std::nullopt;
}

/// Bytes that a device loads, as a pikoir_cuda_image.
static Constant *makeImage(Module &host, StringRef name, StringRef bytes,
                           int32_t chip, bool isExact) {
  LLVMContext &context = host.getContext();
  Constant *value =
      ConstantDataArray::getString(context, bytes, /*AddNull=*/chip == 0);
  auto *image = new GlobalVariable(host, value->getType(), /*isConstant=*/true,
                                   GlobalValue::InternalLinkage, value, name);
  image->setAlignment(Align(16));
  auto *number = Type::getInt32Ty(context);
  return ConstantStruct::getAnon({ConstantInt::get(number, chip),
                                  ConstantInt::get(number, isExact), image});
}

/// The list with an end, in place of its declaration.
static void defineList(Module &host, GlobalVariable *declared,
                       SmallVector<Constant *> images) {
  images.push_back(Constant::getNullValue(images.front()->getType()));
  auto *type = ArrayType::get(images.front()->getType(), images.size());
  auto *list = new GlobalVariable(host, type, /*isConstant=*/true,
                                  GlobalValue::InternalLinkage,
                                  ConstantArray::get(type, images));
  declared->replaceAllUsesWith(list);
  list->takeName(declared);
  declared->eraseFromParent();
}

/// A block's shared memory is declared in PTX, and 48 KB is what drivers give
/// to that.
static Error checkBlockMemory(const Module &module) {
  for (const KernelResources &kernel : findKernels(module))
    if (kernel.blockMemory > maxSharedBytes)
      return createStringError(
          "kernel '" + kernel.kernel + "' needs " + Twine(kernel.blockMemory) +
          " bytes of the memory of a block of " + Twine(kernel.threads) +
          " threads, but a block has " + Twine(maxSharedBytes) +
          "; --gpu-threads with fewer takes less");
  return Error::success();
}

Error piko::embedKernels(Module &host, Module &kernels, StringRef name,
                         const GPUOptions &gpu, int optLevel,
                         function_ref<void(const MissingCubin &)> report) {
  for (const std::string &chip : gpu.cubins)
    if (Error error = checkChip(chip))
      return error;
  Expected<std::string> ptx = generatePTX(kernels, gpu.chip, optLevel);
  if (!ptx)
    return ptx.takeError();
  if (Error error = checkBlockMemory(kernels))
    return error;
  GlobalVariable *declared = host.getGlobalVariable(name);
  if (!declared)
    return createStringError("expected '" + name + "' in the host's code");
  std::string assembler = gpu.cubins.empty() ? "" : findAssembler();
  SmallVector<Constant *> images;
  for (const std::string &chip : gpu.cubins)
    if (auto cubin = makeCubin(assembler, kernels, *ptx, chip, report))
      images.push_back(makeImage(host, (name + "." + chip).str(), *cubin,
                                 getChipNumber(chip),
                                 StringRef(chip).ends_with("a")));
  images.push_back(makeImage(host, (name + ".ptx").str(), *ptx, /*chip=*/0,
                             /*isExact=*/false));
  defineList(host, declared, std::move(images));
  return Error::success();
}
