// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Cache/KnownFiles.h"
#include "../Support/TemporaryFolder.h"

#include "llvm/Support/MemoryBuffer.h"

#include <chrono>

using namespace piko;
namespace fs = std::filesystem;

namespace {

class KnownFilesTest : public TemporaryFolder {
protected:
  /// Writes a file whose last change was so many seconds ago.
  void writeThen(const std::string &name, const std::string &text,
                 int seconds) const {
    fs::last_write_time(write(name, text), fs::file_time_type::clock::now() -
                                               std::chrono::seconds(seconds));
  }
  std::string read(const std::string &name) {
    auto file = files->openFileForRead(pathOf(name));
    if (!file)
      return "no file";
    EXPECT_EQ((*file)->status()->getName(), pathOf(name));
    EXPECT_EQ(*(*file)->getName(), pathOf(name));
    auto text = (*file)->getBuffer(name);
    return text ? (*text)->getBuffer().str() : "no text";
  }

  llvm::IntrusiveRefCntPtr<KnownFiles> files =
      llvm::makeIntrusiveRefCnt<KnownFiles>();
};

TEST_F(KnownFilesTest, AChangeIsSeen) {
  writeThen("a.h", "one", 3600);
  EXPECT_EQ(read("a.h"), "one");
  EXPECT_EQ(read("a.h"), "one");
  writeThen("a.h", "two", 3000); // of the same size, in the same file
  EXPECT_EQ(read("a.h"), "two");
  fs::remove(pathOf("a.h"));
  EXPECT_EQ(read("a.h"), "no file");
}

// Within the clock of a file system's times.
TEST_F(KnownFilesTest, AChangeAtOnceIsSeen) {
  for (const char *text : {"one", "two", "six"}) {
    write("b.h", text);
    EXPECT_EQ(read("b.h"), text);
  }
}

// What is kept is what is read: the disk is not asked for it again.
TEST_F(KnownFilesTest, WhatIsKnownIsNotRead) {
  writeThen("c.h", "one", 3600);
  EXPECT_EQ(read("c.h"), "one");
  auto time = fs::last_write_time(pathOf("c.h"));
  write("c.h", "two");
  fs::last_write_time(pathOf("c.h"), time); // a change that nothing shows
  EXPECT_EQ(read("c.h"), "one");
}

} // namespace
