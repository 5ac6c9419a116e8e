// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Names of processors, on other machines than this one.

#include "Piko/Target/Processor.h"

#include "llvm/ADT/StringMap.h"
#include "llvm/TargetParser/Host.h"

#include <gtest/gtest.h>

using namespace piko;

TEST(Processor, ListsAreForX86) {
  llvm::Triple triple("aarch64-unknown-linux-gnu");
  auto processors = resolveProcessors("cortex-a72,neoverse-n1", triple);
  ASSERT_FALSE(bool(processors));
  EXPECT_EQ(llvm::toString(processors.takeError()),
            "expected one processor, because objects for aarch64 cannot choose "
            "between several, but got 'cortex-a72,neoverse-n1'");
}

TEST(Processor, OfAnotherArchitecture) {
  auto triple = resolveTriple("aarch64");
  ASSERT_TRUE(bool(triple));
  EXPECT_TRUE(triple->isAArch64());
  EXPECT_TRUE(triple->isOSLinux());
  auto generic = resolveProcessor("", *triple);
  ASSERT_TRUE(bool(generic));
  EXPECT_EQ(generic->name, "generic");
  EXPECT_EQ(generic->lanes, 4);
  EXPECT_TRUE(generic->needs.empty());
  auto wrong = resolveProcessor("x86-64-v3", *triple);
  ASSERT_FALSE(bool(wrong));
  EXPECT_EQ(
      llvm::toString(wrong.takeError()),
      "there is no processor 'x86-64-v3' for aarch64; expected a name that "
      "'clang --target=aarch64-linux --print-supported-cpus' lists");
}

TEST(Processor, ArchitecturesAreNamed) {
  auto triple = resolveTriple("arm64");
  ASSERT_FALSE(bool(triple));
  EXPECT_EQ(llvm::toString(triple.takeError()),
            "expected the architecture x86_64 or aarch64, but got 'arm64'");
}

#if defined(__x86_64__)
TEST(Processor, NativeIsOfThisMachine) {
  llvm::Triple triple("aarch64-unknown-linux-gnu");
  auto native = resolveProcessor("native", triple);
  ASSERT_FALSE(bool(native));
  EXPECT_EQ(llvm::toString(native.takeError()),
            "expected the name of a processor, because 'native' is this "
            "machine's, which does not run code for aarch64");
}

TEST(Processor, NeedsWhatCodeMayUse) {
  auto base = resolveProcessor("x86-64");
  ASSERT_TRUE(bool(base));
  EXPECT_TRUE(base->needs.empty());
  auto v3 = resolveProcessor("");
  ASSERT_TRUE(bool(v3));
  EXPECT_EQ(v3->name, "x86-64-v3");
  std::vector<llvm::StringRef> expected = {
      "sse3", "ssse3", "fma", "cx16", "sse4.1", "sse4.2", "movbe", "popcnt",
      "avx",  "f16c",  "bmi", "avx2", "bmi2",   "sahf",   "lzcnt"};
  EXPECT_EQ(v3->needs, expected);
}

/// The runtime looks for nothing that LLVM would not see on this machine: code
/// for `native` would need what the name of the processor promises.
TEST(Processor, LLVMLooksForTheSameFeatures) {
  llvm::StringMap<bool> seen = llvm::sys::getHostCPUFeatures();
#define PIKO_FEATURE(name, leaf, subleaf, reg, shift, width, least, state)     \
  EXPECT_TRUE(seen.contains(name)) << name;
#include "pikort/processor.def"
  auto native = resolveProcessor("native");
  ASSERT_TRUE(bool(native));
  EXPECT_FALSE(native->needs.empty());
  for (llvm::StringRef need : native->needs)
    EXPECT_TRUE(seen.lookup(need)) << need.str();
}
#endif
