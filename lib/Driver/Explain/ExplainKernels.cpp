// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Explain/ExplainKernels.h"

#include "Piko/Driver/Compiler.h"
#include "Piko/Target/KernelResources.h"
#include "Piko/Target/PTX.h"
#include "pikort/grid.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/Format.h"
#include "llvm/Support/MathExtras.h"

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Units of work
//===----------------------------------------------------------------------===//

void piko::explainUnits(ArrayRef<KernelUnits> kernels, raw_ostream &out) {
  out << "\nUnits of work, of n blocks that fill the device:\n";
  for (const auto &[kernel, order] : kernels)
    out << "  " << kernel
        << (order == UnitOrder::Fixed
                ? ": block b takes the units b, b + n, ..\n"
            : order == UnitOrder::Dispatched
                ? ": the hardware begins a block for each; of more than n, a "
                  "block takes the next one when it has ended one\n"
                : ": a block takes the next one when it has ended one\n");
}

//===----------------------------------------------------------------------===//
// Resources
//===----------------------------------------------------------------------===//

/// What a driver keeps of the device's memory, from the first launch on.
static void writeStacks(ArrayRef<KernelResources> kernels, StringRef chip,
                        raw_ostream &out) {
  int64_t most = 0;
  for (const KernelResources &kernel : kernels)
    if (kernel.assembled)
      most = std::max(most, kernel.assembled->stack);
  if (auto threads = getResidentThreads(chip); threads && most > 0)
    out << "  For the largest stack a driver keeps "
        << llvm::divideCeil(*threads * most, 1024)
        << " KB of memory a multiprocessor, for all threads that it may have\n";
}

static void writeResources(const KernelReport &report, StringRef chip,
                           StringRef prefix, raw_ostream &out) {
  ArrayRef<KernelResources> kernels = report.kernels;
  bool isAssembled = llvm::any_of(kernels, [](const KernelResources &k) {
    return k.assembled.has_value();
  });
  out << "\nOn " << chip
      << (isAssembled ? ", as ptxas says" : " (" + report.source + ")")
      << ":\n  threads  block memory";
  if (isAssembled)
    out << "  registers  stack  spilled  occupancy";
  out << "  kernel\n";
  for (const KernelResources &kernel : kernels) {
    StringRef name = kernel.kernel;
    name.consume_front(prefix);
    out << llvm::format("  %7lld  %12lld", (long long)kernel.threads,
                        (long long)kernel.blockMemory);
    if (const auto &found = kernel.assembled)
      out << llvm::format("  %9lld  %5lld  %7lld", (long long)found->registers,
                          (long long)found->stack,
                          (long long)(found->spillStores + found->spillLoads));
    if (auto occupancy = kernel.getOccupancy(chip))
      out << llvm::format("  %7.0f %%", 100 * *occupancy);
    else if (isAssembled)
      out << "          -";
    out << "  " << name << "\n";
  }
  writeStacks(kernels, chip, out);
}

LogicalResult piko::explainResources(ModuleOp module, StringRef pipeline,
                                     const GPUOptions &gpu, int optLevel,
                                     raw_ostream &out) {
  llvm::LLVMContext context;
  std::unique_ptr<llvm::Module> kernels = translateKernels(module, context);
  if (!kernels)
    return failure();
  auto fail = [&](llvm::Error error) {
    return emitError(module.getLoc()) << llvm::toString(std::move(error));
  };
  llvm::Expected<std::string> ptx = generatePTX(*kernels, gpu.chip, optLevel);
  if (!ptx)
    return fail(ptx.takeError());
  std::vector<std::string> chips = gpu.cubins;
  if (chips.empty())
    chips.push_back(gpu.chip);
  for (const std::string &chip : chips) {
    auto resources = measureKernels(*kernels, *ptx, chip);
    if (!resources)
      return fail(resources.takeError());
    writeResources(*resources, chip, (pipeline + "_").str(), out);
  }
  return success();
}

//===----------------------------------------------------------------------===//
// Traffic
//===----------------------------------------------------------------------===//

/// An entry of the log that holds so many bytes.
static int64_t getEntryBytes(int64_t bytes) {
  constexpr int64_t alignment = 16;
  return llvm::alignTo(sizeof(pikoir_entry) + bytes, alignment);
}

/// "reads 12 to 40 B", unless it is nothing.
static void writeRange(StringRef verb, const ByteRange &range,
                       SmallVectorImpl<std::string> &phrases) {
  if (range.most == 0)
    return;
  std::string text = (verb + " ").str();
  if (range.least != range.most)
    text += std::to_string(range.least) + " to ";
  phrases.push_back(text + std::to_string(range.most) + " B");
}

static void writePart(const TrafficPart &part, raw_ostream &out) {
  SmallVector<std::string> phrases;
  writeRange("reads", part.reads, phrases);
  writeRange("writes", part.writes, phrases);
  writeRange("changes atomically", part.atomics, phrases);
  out.indent(4 + 2 * part.depth)
      << "each " << part.per << ": " << llvm::join(phrases, ", ") << "\n";
}

static void writeEmission(const TrafficEmission &emission, raw_ostream &out) {
  out << "    each primitive emitted";
  if (!emission.consumer.empty())
    out << " to " << emission.consumer;
  out << ": writes " << getEntryBytes(emission.bytes) << " B, of which "
      << emission.bytes << " are the record";
  if (emission.isLocal)
    out << "; copied for its block, which reads it there";
  out << "\n";
}

void piko::explainTraffic(ArrayRef<KernelTraffic> kernels, raw_ostream &out) {
  out << "\nGlobal memory, as kernels' text reads and writes it (caches, "
         "constants and what edges' joins move are not in it):\n";
  for (const KernelTraffic &kernel : kernels) {
    out << "  " << kernel.kernel << "\n";
    for (const TrafficPart &part : kernel.parts)
      writePart(part, out);
    for (const TrafficEmission &emission : kernel.emissions)
      writeEmission(emission, out);
    for (const std::string &stage : kernel.placements)
      out << "    each bin of " << stage
          << " that a primitive is put into: writes "
          << getEntryBytes(sizeof(int64_t)) << " B\n";
    if (!kernel.unknown.empty())
      out << "    not known: " << llvm::join(kernel.unknown, ", ") << "\n";
  }
}
