// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The processors that code is made for.

#include "Piko/Target/Processor.h"

#include "Piko/Target/CodeGeneration.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/Config/Targets.h"
#include "llvm/MC/MCSubtargetInfo.h"
#include "llvm/Support/TargetSelect.h"
#include "llvm/TargetParser/Host.h"

using namespace llvm;
using namespace piko;

/// Those that the runtime looks for.
static constexpr StringLiteral checkedFeatures[] = {
#define PIKO_FEATURE(name, leaf, subleaf, reg, shift, width, least, state) name,
#include "pikort/processor.def"
};

/// The CPUs that objects run on where the user does not say more: those since
/// about 2013 (AVX2, FMA), or what every machine of another family has.
static StringRef getDefaultProcessor(const Triple &triple) {
  return triple.getArch() == Triple::x86_64 ? "x86-64-v3" : "generic";
}

StringRef piko::getBaseProcessor(const Triple &triple) {
  return triple.getArch() == Triple::x86_64 ? "x86-64" : "generic";
}

Expected<Triple> piko::resolveTriple(StringRef arch) {
  Triple host(sys::getProcessTriple());
  if (arch.empty() || arch == host.getArchName())
    return host;
  for (StringRef other : {"x86_64", "aarch64"})
    if (arch == other) {
      host.setArchName(other);
      return host;
    }
  return createStringError("expected the architecture x86_64 or aarch64, but "
                           "got '" +
                           arch + "'");
}

Expected<const Target *> piko::initializeTarget(const Triple &triple) {
  InitializeNativeTarget();
  InitializeNativeTargetAsmPrinter();
#if LLVM_HAS_AARCH64_TARGET
  if (triple.isAArch64()) {
    LLVMInitializeAArch64TargetInfo();
    LLVMInitializeAArch64Target();
    LLVMInitializeAArch64TargetMC();
    LLVMInitializeAArch64AsmPrinter();
  }
#endif
#if LLVM_HAS_X86_TARGET
  if (triple.isX86()) {
    LLVMInitializeX86TargetInfo();
    LLVMInitializeX86Target();
    LLVMInitializeX86TargetMC();
    LLVMInitializeX86AsmPrinter();
  }
#endif
  return lookUpTarget(triple);
}

static Processor getNativeProcessor() {
  Processor host{sys::getHostCPUName().str(), ""};
  std::vector<std::string> features;
  for (const auto &feature : sys::getHostCPUFeatures())
    features.push_back((feature.second ? "+" : "-") + feature.first().str());
  llvm::sort(features);
  host.features = llvm::join(features, ",");
  return host;
}

static int64_t getLanes(const MCSubtargetInfo &info) {
  if (info.checkFeatures("+avx512f,+avx512bw,+avx512dq,+avx512vl"))
    return 16;
  return info.checkFeatures("+avx2") ? 8 : 4;
}

static void findFeatures(const Target &target, const Triple &triple,
                         Processor &processor) {
  if (triple.getArch() != Triple::x86_64)
    return;
  std::unique_ptr<MCSubtargetInfo> info(
      target.createMCSubtargetInfo(triple, processor.name, processor.features));
  StringSet<> enabled;
  for (const SubtargetFeatureKV &feature : info->getEnabledProcessorFeatures())
    enabled.insert(feature.Key);
  for (StringRef name : checkedFeatures)
    if (enabled.contains(name))
      processor.needs.push_back(name);
  processor.lanes = getLanes(*info);
  // LLVM takes a branch for each lane where it does not know gathers as fast.
  if (info->checkFeatures("+avx2"))
    processor.features +=
        processor.features.empty() ? "+fast-gather" : ",+fast-gather";
}

Expected<Processor> piko::resolveProcessor(StringRef cpu) {
  return resolveProcessor(cpu, Triple(sys::getProcessTriple()));
}

/// An error for a name that no processor of the architecture has.
static Error refuseProcessor(StringRef cpu, const Triple &triple,
                             bool isForeign) {
  std::string list = "'clang --print-supported-cpus' lists";
  if (!isForeign)
    return createStringError("there is no processor '" + cpu + "' for " +
                             triple.getArchName() +
                             "; expected 'native' or a name that " + list);
  list = ("'clang --target=" + triple.getArchName() +
          "-linux --print-supported-cpus' lists")
             .str();
  if (cpu == "native")
    return createStringError(
        "expected the name of a processor, because 'native' is this machine's, "
        "which does not run code for " +
        triple.getArchName());
  return createStringError("there is no processor '" + cpu + "' for " +
                           triple.getArchName() + "; expected a name that " +
                           list);
}

Expected<Processor> piko::resolveProcessor(StringRef cpu,
                                           const Triple &triple) {
  Expected<const Target *> target = initializeTarget(triple);
  if (!target)
    return target.takeError();
  bool isForeign =
      triple.getArch() != Triple(sys::getProcessTriple()).getArch();
  Processor processor;
  if (cpu == "native" && !isForeign)
    processor = getNativeProcessor();
  else if (cpu.empty())
    processor.name = getDefaultProcessor(triple);
  else if (hasProcessor(**target, triple, cpu))
    processor.name = cpu;
  else
    return refuseProcessor(cpu, triple, isForeign);
  findFeatures(**target, triple, processor);
  return processor;
}

/// Checks that each of the processors is the last that fits some machine.
static Error checkOrder(ArrayRef<Processor> processors) {
  for (size_t i = 0; i < processors.size(); ++i)
    for (const Processor &later : processors.drop_front(i + 1)) {
      const Processor &one = processors[i];
      if (one.name == later.name)
        return createStringError("expected each processor once, but got '" +
                                 one.name + "' twice");
      if (llvm::all_of(later.needs, [&](StringRef need) {
            return llvm::is_contained(one.needs, need);
          }))
        return createStringError(
            "code for '" + one.name +
            "' would never run: the last of the processors that fits is taken, "
            "and '" +
            later.name + "' fits wherever it does; swap them");
    }
  return Error::success();
}

Expected<std::vector<Processor>> piko::resolveProcessors(StringRef cpus,
                                                         const Triple &triple) {
  SmallVector<StringRef> names;
  cpus.split(names, ',');
  if (names.size() > 1 && triple.getArch() != Triple::x86_64)
    return createStringError(
        "expected one processor, because objects for " + triple.getArchName() +
        " cannot choose between several, but got '" + cpus + "'");
  std::vector<Processor> processors;
  for (StringRef name : names) {
    if (name.empty() && names.size() > 1)
      return createStringError(
          "expected names of processors between commas, but got '" + cpus +
          "'");
    Expected<Processor> processor = resolveProcessor(name, triple);
    if (!processor)
      return processor.takeError();
    processors.push_back(std::move(*processor));
  }
  if (Error error = checkOrder(processors))
    return error;
  return processors;
}
