//===- TemporaryFolder.h - A place for a test's files -----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_SUPPORT_TEMPORARYFOLDER_H
#define PIKO_UNITTESTS_SUPPORT_TEMPORARYFOLDER_H

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

/// A test whose files live in a folder of their own, which goes with it.
class TemporaryFolder : public testing::Test {
protected:
  void SetUp() override {
    const auto *test = testing::UnitTest::GetInstance()->current_test_info();
    folder =
        std::filesystem::path(testing::TempDir()) /
        (std::string("piko-") + test->name() + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::string pathOf(const std::string &name) const {
    return (folder / name).string();
  }
  std::string write(const std::string &name, const std::string &content) const {
    std::ofstream(pathOf(name), std::ios::binary) << content;
    return pathOf(name);
  }

  std::filesystem::path folder;
};

#endif // PIKO_UNITTESTS_SUPPORT_TEMPORARYFOLDER_H
