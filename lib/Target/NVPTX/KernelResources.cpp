// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The limits of chips are those of the table "Technical Specifications per
// Compute Capability" in NVIDIA's CUDA C++ Programming Guide.

#include "Piko/Target/KernelResources.h"
#include "Piko/Analysis/TargetModel.h"

#include "KernelReports.h"

#include "Piko/Target/Assembler.h"

#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/Instructions.h"
#include "llvm/Support/MathExtras.h"

using namespace llvm;
using namespace piko;

//===----------------------------------------------------------------------===//
// Occupancy
//===----------------------------------------------------------------------===//

namespace {
/// Of a multiprocessor.
struct ChipLimits {
  const char *chip;
  int64_t threads, blocks, blockMemory;
  int64_t reserved; ///< Of the memory of each block, for the system.
};
} // namespace

static constexpr ChipLimits chips[] = {{"sm_70", 2048, 32, 96 << 10, 0},
                                       {"sm_72", 2048, 32, 96 << 10, 0},
                                       {"sm_75", 1024, 16, 64 << 10, 0},
                                       {"sm_80", 2048, 32, 164 << 10, 1024},
                                       {"sm_86", 1536, 16, 100 << 10, 1024},
                                       {"sm_87", 1536, 16, 164 << 10, 1024},
                                       {"sm_89", 1536, 24, 100 << 10, 1024},
                                       {"sm_90", 2048, 32, 228 << 10, 1024},
                                       {"sm_100", 2048, 32, 228 << 10, 1024},
                                       {"sm_120", 1536, 32, 100 << 10, 1024}};

static const ChipLimits *findLimits(StringRef chip) {
  const auto *limits =
      find_if(chips, [&](const ChipLimits &each) { return chip == each.chip; });
  return limits == std::end(chips) ? nullptr : limits;
}

std::optional<int64_t> piko::getResidentThreads(StringRef chip) {
  const ChipLimits *limits = findLimits(chip);
  if (!limits)
    return std::nullopt;
  return limits->threads;
}

std::optional<double> KernelResources::getOccupancy(StringRef chip) const {
  const ChipLimits *limits = findLimits(chip);
  if (!limits || !assembled || threads == 0)
    return std::nullopt;
  int64_t warps = divideCeil(threads, warpSize);
  int64_t ofWarp = alignTo(
      std::max<int64_t>(assembled->registers, 1) * warpSize, registerPiece);
  int64_t memory = alignTo(blockMemory + limits->reserved, 128);
  int64_t blocks =
      std::min({limits->blocks, limits->threads / (warps * warpSize),
                registersOfMultiprocessor / (ofWarp * warps),
                limits->blockMemory / std::max<int64_t>(memory, 1)});
  return double(blocks * warps * warpSize) / double(limits->threads);
}

//===----------------------------------------------------------------------===//
// From the module
//===----------------------------------------------------------------------===//

/// The functions that use a variable.
static void collectUsers(const User *user,
                         SmallSetVector<const Function *, 4> &functions) {
  if (auto *instruction = dyn_cast<Instruction>(user))
    functions.insert(instruction->getFunction());
  else
    for (const User *next : user->users())
      collectUsers(next, functions);
}

std::vector<KernelResources> piko::findKernels(const Module &module) {
  std::vector<KernelResources> kernels;
  constexpr unsigned sharedSpace = 3;
  for (const Function &function : module) {
    if (function.getCallingConv() != CallingConv::PTX_Kernel)
      continue;
    KernelResources &kernel = kernels.emplace_back();
    kernel.kernel = function.getName().str();
    StringRef extents =
        function.getFnAttribute("nvvm.maxntid").getValueAsString();
    to_integer(extents.split(',').first, kernel.threads);
    for (const GlobalVariable &variable : module.globals()) {
      SmallSetVector<const Function *, 4> users;
      for (const User *user : variable.users())
        collectUsers(user, users);
      if (variable.getAddressSpace() == sharedSpace &&
          users.contains(&function))
        kernel.blockMemory += static_cast<int64_t>(
            module.getDataLayout().getTypeAllocSize(variable.getValueType()));
    }
  }
  return kernels;
}

//===----------------------------------------------------------------------===//
// From the assembler
//===----------------------------------------------------------------------===//

/// The number before `what` in a line.
static int64_t getNumberBefore(StringRef line, StringRef what) {
  int64_t number = 0;
  StringRef before = line.take_front(line.find(what)).rtrim();
  to_integer(before.substr(before.find_last_of(" ,") + 1), number);
  return number;
}

/// Reads what `ptxas -v` prints: a line with the kernel's name, one with its
/// stack and spills, one with its registers; then the same of functions that it
/// calls, whose spills are theirs.
void piko::readReport(StringRef report, std::vector<KernelResources> &kernels) {
  KernelResources *kernel = nullptr;
  bool isOwn = false;
  for (StringRef line : split(report, '\n')) {
    if (line.contains("Compiling entry function")) {
      StringRef name = line.split('\'').second.split('\'').first;
      auto found = find_if(kernels, [&](const KernelResources &each) {
        return name == each.kernel;
      });
      kernel = found == kernels.end() ? nullptr : &*found;
      if (kernel)
        kernel->assembled.emplace();
    } else if (line.contains("Function properties for ")) {
      isOwn = kernel && line.rtrim().ends_with(" " + kernel->kernel);
    } else if (kernel && isOwn && line.contains("bytes stack frame")) {
      kernel->assembled->stack = getNumberBefore(line, "bytes stack frame");
      kernel->assembled->spillStores =
          getNumberBefore(line, "bytes spill stores");
      kernel->assembled->spillLoads =
          getNumberBefore(line, "bytes spill loads");
    } else if (kernel && line.contains("Used ")) {
      kernel->assembled->registers = getNumberBefore(line, "registers");
    }
  }
}

Expected<KernelReport> piko::measureKernels(const Module &module, StringRef ptx,
                                            StringRef chip) {
  std::string assembler = findAssembler();
  if (assembler.empty())
    return KernelReport{findKernels(module),
                        "no ptxas was found to say the rest"};
  auto assembled = assembleKernels(assembler, module, ptx, chip);
  if (assembled)
    return KernelReport{std::move(assembled->kernels), "ptxas"};
  if (knowsChip(assembler, chip))
    return assembled.takeError();
  consumeError(assembled.takeError());
  return KernelReport{findKernels(module),
                      ("the ptxas that was found does not know " + chip).str()};
}
