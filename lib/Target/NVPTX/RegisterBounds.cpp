// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// ptxas spills where it takes more threads at a time to be worth it, or where a
// bound says so (.maxnreg). A few registers more may spare all of that at
// little cost, and how many only ptxas can say:
//   1. assemble; kernels that spill no more than such registers could hold get
//      a higher bound, as long as at least three quarters of the threads still
//      have room;
//   2. again, those alone, at most three times, by 8 registers each;
//   3. those that spill all the same have what they had.

#include "KernelReports.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Target/Assembler.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/InstrTypes.h"
#include "llvm/Support/MathExtras.h"

using namespace llvm;
using namespace piko;

/// What a thread gets of a piece.
static constexpr int64_t piece = registerPiece / warpSize, tries = 3;
static constexpr double leastOccupancy = 0.75;

static bool spills(const KernelResources &kernel) {
  return kernel.assembled &&
         kernel.assembled->spillStores + kernel.assembled->spillLoads > 0;
}

/// Whether what it spills may find room in the registers of all tries.
static bool spillsLittle(const KernelResources &kernel) {
  constexpr int64_t registerBytes = 4;
  return spills(kernel) &&
         kernel.assembled->spillStores <= tries * piece * registerBytes;
}

/// PTX in which a kernel's directives say the bound.
static std::string setBound(StringRef ptx, StringRef kernel, int64_t bound) {
  size_t entry = ptx.find((".entry " + kernel + "(").str());
  size_t body = ptx.find("\n{", entry);
  if (entry == StringRef::npos || body == StringRef::npos)
    return ptx.str();
  StringRef head = ptx.take_front(body), rest = ptx.drop_front(body);
  size_t known = head.find("\n.maxnreg ", entry);
  if (known != StringRef::npos)
    head = head.take_front(known);
  return (head + "\n.maxnreg " + Twine(bound) + rest).str();
}

/// Whether the threads that find room are enough of those of before.
static bool isWorthIt(const KernelResources &before, int64_t bound,
                      StringRef chip) {
  KernelResources more = before;
  more.assembled->registers = bound;
  std::optional<double> had = before.getOccupancy(chip),
                        has = more.getOccupancy(chip);
  if (!had || !has)
    return double(before.assembled->registers) >=
           leastOccupancy * double(bound);
  return *has >= leastOccupancy * *had;
}

namespace {
class RegisterBounds {
public:
  RegisterBounds(StringRef assembler, const Module &module, StringRef ptx,
                 StringRef chip)
      : assembler(assembler), module(module), ptx(ptx), chip(chip),
        first(findKernels(module)) {}
  Expected<AssembledKernels> run();

private:
  /// Gives kernels that spill a few registers more; their names.
  std::vector<std::string> raise();
  bool callsFunction(StringRef kernel) const;
  /// With the bounds that there are: all kernels, or some.
  Expected<Assembly> assembleBounded(ArrayRef<std::string> kernels = {});

  StringRef assembler;
  const Module &module;
  StringRef ptx, chip;
  std::vector<KernelResources> first, now;
  std::vector<int64_t> bounds; ///< 0: what ptxas, or the text, chooses.
};
} // namespace

/// What it calls is rare, and spills by itself.
bool RegisterBounds::callsFunction(StringRef kernel) const {
  const Function *function = module.getFunction(kernel);
  return function && any_of(instructions(*function), [](const auto &each) {
           auto *call = dyn_cast<CallBase>(&each);
           return call && call->getCalledFunction() &&
                  !call->getCalledFunction()->isDeclaration();
         });
}

Expected<Assembly>
RegisterBounds::assembleBounded(ArrayRef<std::string> kernels) {
  std::string text = ptx.str();
  for (auto [kernel, bound] : zip(first, bounds))
    if (bound != 0)
      text = setBound(text, kernel.kernel, bound);
  return assemble(assembler, text, chip, kernels);
}

std::vector<std::string> RegisterBounds::raise() {
  std::vector<std::string> raised;
  for (auto [before, kernel, bound] : zip(first, now, bounds)) {
    if (!spillsLittle(kernel) || callsFunction(kernel.kernel))
      continue;
    int64_t known = std::max(bound, kernel.assembled->registers);
    int64_t next = alignDown(known, piece) + piece;
    if (next > maxRegistersOfThread || !isWorthIt(before, next, chip))
      continue;
    bound = next;
    raised.push_back(kernel.kernel);
  }
  return raised;
}

Expected<AssembledKernels> RegisterBounds::run() {
  bounds.resize(first.size());
  Expected<Assembly> assembly = assembleBounded();
  if (!assembly)
    return assembly.takeError();
  readReport(assembly->report, first);
  now = first;
  for (int64_t i = 0; i < tries; ++i) {
    std::vector<std::string> raised = raise();
    if (raised.empty())
      break;
    Expected<Assembly> some = assembleBounded(raised);
    if (!some)
      return some.takeError();
    readReport(some->report, now);
  }
  bool isBetter = false;
  for (auto [kernel, bound] : zip(now, bounds)) {
    bound = spills(kernel) ? 0 : bound;
    isBetter |= bound != 0;
  }
  if (!isBetter)
    return AssembledKernels{std::move(first), std::move(assembly->cubin)};
  Expected<Assembly> all = assembleBounded();
  if (!all)
    return all.takeError();
  readReport(all->report, now);
  return AssembledKernels{std::move(now), std::move(all->cubin)};
}

Expected<AssembledKernels> piko::assembleKernels(StringRef assembler,
                                                 const Module &module,
                                                 StringRef ptx,
                                                 StringRef chip) {
  return RegisterBounds(assembler, module, ptx, chip).run();
}
