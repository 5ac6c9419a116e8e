// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- ThreadsTest.cpp - How many threads there may be --------------------===//

#include "cpu/Threads.h"

#include "../../unittests/Support/TemporaryFolder.h"

#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <thread>
#include <vector>

using namespace piko::rt;

namespace {

constexpr int32_t none = std::numeric_limits<int32_t>::max();

/// Files of control groups.
class Quotas : public TemporaryFolder {
protected:
  void group(const std::string &path, const std::string &file,
             const std::string &content) {
    std::filesystem::create_directories(folder / path);
    std::ofstream(folder / path / file) << content;
  }
  int32_t count(const std::string &groups) const {
    return processorsOfQuota(groups, folder.string());
  }
};

TEST_F(Quotas, OfTheUnifiedHierarchy) {
  group("a/b", "cpu.max", "max 100000\n");
  EXPECT_EQ(count("0::/a/b\n"), none);
  EXPECT_EQ(count("0::/\n"), none);
  EXPECT_EQ(count(""), none);
  EXPECT_EQ(count("0::/a/none\n"), none);
  group("a", "cpu.max", "350000 100000\n");
  EXPECT_EQ(count("0::/a/b\n"), 4); // rounded up
  group("a/b", "cpu.max", "50000 100000\n");
  EXPECT_EQ(count("0::/a/b\n"), 1); // half a processor
  EXPECT_EQ(count("0::/a\n"), 4);
  group("", "cpu.max", "200000 100000\n"); // as a container's root has it
  EXPECT_EQ(count("0::/a\n"), 2);
  EXPECT_EQ(count("0::/\n"), 2);
}

TEST_F(Quotas, OfTheFirstVersion) {
  group("cpu,cpuacct/a", "cpu.cfs_quota_us", "150000\n");
  group("cpu,cpuacct/a", "cpu.cfs_period_us", "100000\n");
  const std::string groups = "12:pids:/a\n4:cpu,cpuacct:/a\n2:cpuset:/a\n";
  EXPECT_EQ(count(groups), 2);
  group("cpu,cpuacct/a", "cpu.cfs_quota_us", "-1\n");
  EXPECT_EQ(count(groups), none);
}

TEST_F(Quotas, ThatAreNoNumbers) {
  for (const char *content :
       {"", "x", "0 0\n", "-1 100000\n", "5\n", "99999999999999999999 1\n"}) {
    group("", "cpu.max", content);
    EXPECT_EQ(count("0::/\n"), none) << content;
  }
  for (const char *groups : {":", "::", "0:", "\n\n", "0:cpu:", "0::x\n"})
    EXPECT_EQ(count(groups), none) << groups;
}

TEST(Settings, ThatLibompReads) {
  for (const char *sound :
       {"OMP_NUM_THREADS=4", "OMP_NUM_THREADS=4,2", "OMP_NUM_THREADS= 4 , 2 ",
        "OMP_PROC_BIND=close", "KMP_PLAIN_BARRIER=2,2",
        "PATH=", "OMPI_X=", "HOME", "KMP_BLOCKTIME=0"})
    EXPECT_TRUE(isSoundSetting(sound)) << sound;
  for (const char *wrong :
       {"OMP_NUM_THREADS=", "OMP_NUM_THREADS", "OMP_NUM_THREADS=0",
        "OMP_NUM_THREADS=4,", "OMP_NUM_THREADS=,4", "OMP_NUM_THREADS=x",
        "OMP_NUM_THREADS=4 2", "OMP_NUM_THREADS=99999999999",
        "OMP_PLACES=", "KMP_FORKJOIN_BARRIER=0,0", "KMP_PLAIN_BARRIER=x",
        "KMP_INHERIT_FP_CONTROL=1"})
    EXPECT_FALSE(isSoundSetting(wrong)) << wrong;
}

TEST(Threads, AreSomething) {
  EXPECT_GE(defaultThreads(), 1);
  EXPECT_EQ(availableThreads(1), 1);
  EXPECT_EQ(availableThreads(3), 3);
  EXPECT_EQ(availableThreads(2), 2);
}

// As of hosts that make a thread for each frame.
TEST(Threads, OfShortLivedHosts) {
  for (int i = 0; i < 20; ++i)
    std::thread([] {
      EXPECT_EQ(availableThreads(4), 4);
      EXPECT_EQ(availableThreads(6), 6);
    }).join();
  std::vector<std::thread> hosts;
  for (int i = 0; i < 4; ++i)
    hosts.emplace_back([] { EXPECT_EQ(availableThreads(5), 5); });
  for (std::thread &host : hosts)
    host.join();
}

} // namespace
