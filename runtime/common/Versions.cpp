// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Versions.cpp - Which of a program's codes this processor runs ------===//

#include "common/Accelerator.h"
#include "common/Pipeline.h"

#include <algorithm>
#include <cstdlib>
#include <span>
#include <string_view>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

using namespace piko::rt;

// --- What the processor has -------------------------------------------------

#if defined(__x86_64__)

namespace {

struct Feature {
  std::string_view name;
  uint32_t leaf, subleaf;
  int reg, shift, width;
  uint32_t least;
  uint64_t state;
};

constexpr Feature knownFeatures[] = {
#define PIKO_FEATURE(name, leaf, subleaf, reg, shift, width, least, state)     \
  {name, leaf, subleaf, reg, shift, width, least, state},
#include "pikort/processor.def"
};

} // namespace

/// XCR0: the registers that the system keeps when it switches threads.
static uint64_t keptState() {
  uint32_t eax, ebx, ecx, edx;
  if (!__get_cpuid(1, &eax, &ebx, &ecx, &edx) || !(ecx & bit_OSXSAVE))
    return 0;
  uint32_t low, high;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return uint64_t(high) << 32 | low;
}

/// Asks once for each leaf, which takes long in a virtual machine.
static std::vector<std::string_view> detectFeatures() {
  std::vector<std::string_view> found;
  uint64_t kept = keptState();
  uint32_t registers[4] = {};
  const Feature *asked = nullptr;
  for (const Feature &feature : knownFeatures) {
    if (!asked || asked->leaf != feature.leaf ||
        asked->subleaf != feature.subleaf) {
      asked = &feature;
      if (!__get_cpuid_count(feature.leaf, feature.subleaf, &registers[0],
                             &registers[1], &registers[2], &registers[3]))
        std::fill_n(registers, 4, 0);
    }
    uint32_t value =
        registers[feature.reg] >> feature.shift & ((1u << feature.width) - 1);
    if (value >= feature.least && (kept & feature.state) == feature.state)
      found.push_back(feature.name);
  }
  return found;
}

#else

/// No program for such a processor says what it needs.
static std::vector<std::string_view> detectFeatures() { return {}; }

#endif

// --- The choice -------------------------------------------------------------

/// The features that a version needs, one by one.
template <class Visit>
static void visitNeeds(const pikoir_version &version, Visit visit) {
  std::string_view rest = version.needs;
  while (!rest.empty()) {
    std::string_view name = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), name.size() + 1));
    visit(name);
  }
}

/// Whether there is a device of a kind, and the host wants it.
static bool hasDevice(const pikort_pipeline &p, std::string_view kind) {
  try {
    checkDevice(kind, p.device);
    return true;
  } catch (...) {
    return false;
  }
}

/// The features of a version that this machine lacks, with commas.
static std::string findMissing(const pikort_pipeline &p,
                               const pikoir_version &version) {
  static const std::vector<std::string_view> features = detectFeatures();
  std::string missing;
  visitNeeds(version, [&](std::string_view name) {
    bool has = isDeviceKind(name) ? hasDevice(p, name)
                                  : std::find(features.begin(), features.end(),
                                              name) != features.end();
    if (!has)
      missing.append(missing.empty() ? "" : ", ").append(name);
  });
  return missing;
}

/// A device that the host has chosen by its number must be there, if there is
/// code for one.
static void checkChosenDevice(const pikort_pipeline &p,
                              std::span<const pikoir_version> versions) {
  for (const pikoir_version &version : versions)
    visitNeeds(version, [&](std::string_view name) {
      if (p.device >= 0 && isDeviceKind(name))
        checkDevice(name, p.device);
    });
}

using Versions = std::span<const pikoir_version>;

static std::string listProcessors(Versions versions) {
  std::string names;
  for (const pikoir_version &version : versions)
    names.append(names.empty() ? "" : " or ").append(version.processor);
  return names;
}

[[noreturn]] static void failMissing(const pikort_pipeline &p,
                                     Versions versions) {
  std::string missing;
  for (const pikoir_version &version : versions) {
    missing.append(missing.empty() ? "" : " and ")
        .append(findMissing(p, version));
    if (versions.size() > 1)
      missing.append(" (").append(version.processor).append(")");
  }
  throw Failure{PIKORT_WRONG_PROCESSOR,
                "pipeline " + quoted(p.name) +
                    ": expected a processor that runs code for " +
                    listProcessors(versions) + ", but this one lacks " +
                    missing};
}

/// The one that $PIKO_CPU names, where there are several.
static Versions selectNamed(const pikort_pipeline &p, Versions versions) {
  const char *name = std::getenv("PIKO_CPU");
  if (!name || !*name || versions.size() == 1)
    return versions;
  for (const pikoir_version &version : versions)
    if (std::string_view(name) == version.processor)
      return {&version, 1};
  throw Failure{PIKORT_NOT_FOUND,
                "pipeline " + quoted(p.name) + ": PIKO_CPU: expected " +
                    listProcessors(versions) + ", but got " + quoted(name)};
}

extern "C" {

void pikoir_setup_version(pikort_pipeline *p, const pikoir_version *versions,
                          int32_t count) {
  guarded(p, "setup", [&] {
    if (!versions || count < 1)
      throw Failure{PIKORT_BAD_PROGRAM,
                    "pipeline " + quoted(p->name) +
                        ": expected code for some processor"};
    Versions candidates =
        selectNamed(*p, {versions, static_cast<size_t>(count)});
    checkChosenDevice(*p, candidates);
    auto chosen = std::find_if(candidates.rbegin(), candidates.rend(),
                               [&](const pikoir_version &one) {
                                 return findMissing(*p, one).empty();
                               });
    if (chosen == candidates.rend())
      failMissing(*p, candidates);
    p->processor = chosen->processor;
    p->runProgram = chosen->run;
    chosen->setup(p);
  });
}

const char *pikort_processor(const pikort_pipeline *pipeline) {
  return pipeline ? pipeline->processor.c_str() : "";
}

} // extern "C"
