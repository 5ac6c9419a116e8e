//===- OutputFileTest.cpp - Files that are written whole or not at all ----===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "Piko/Scene/ImageFile.h"
#include "Piko/Support/OutputFile.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>
#include <sys/stat.h>

using namespace piko::render;
using namespace piko::support;
namespace fs = std::filesystem;

namespace {

class OutputFile : public TemporaryFolder {
protected:
  static std::string read(const fs::path &path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  long countFiles() const {
    return std::distance(fs::directory_iterator(folder), {});
  }
};

/// No file of this process may grow beyond a size.
class SizeLimit {
public:
  explicit SizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit limit = {bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~SizeLimit() { setrlimit(RLIMIT_FSIZE, &before); }

private:
  rlimit before;
};

TEST_F(OutputFile, IsMadeAndReplaced) {
  std::string path = folder / "a.txt";
  ASSERT_TRUE(writeFile(path, "first"));
  EXPECT_EQ(read(path), "first");
  ASSERT_TRUE(writeFile(path, "2nd"));
  EXPECT_EQ(read(path), "2nd");
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(OutputFile, ObeysTheMaskAndKeepsPermissions) {
  std::string path = folder / "a.txt";
  mode_t before = umask(027);
  ASSERT_TRUE(writeFile(path, "first"));
  umask(before);
  struct stat status;
  stat(path.c_str(), &status);
  EXPECT_EQ(status.st_mode & 07777, 0640u);
  chmod(path.c_str(), 0604);
  ASSERT_TRUE(writeFile(path, "second"));
  stat(path.c_str(), &status);
  EXPECT_EQ(status.st_mode & 07777, 0604u);
}

TEST_F(OutputFile, WritesThroughLinks) {
  fs::create_directory(folder / "sub");
  fs::create_symlink("sub/real", folder / "link");
  ASSERT_TRUE(writeFile(folder / "link", "first")); // there is no file yet
  ASSERT_TRUE(writeFile(folder / "link", "second"));
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(read(folder / "sub/real"), "second");
}

TEST_F(OutputFile, BeyondALimitTheOldFileStays) {
  std::string path = folder / "a.txt";
  ASSERT_TRUE(writeFile(path, "old"));
  {
    SizeLimit limit(4096); // SIGXFSZ would end the test
    auto ok = writeFile(path, std::string(5000, 'x'));
    ASSERT_FALSE(ok);
    EXPECT_EQ(ok.error().message,
              "cannot write '" + path + "': File too large");
  }
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(countFiles(), 1);
}

TEST_F(OutputFile, PicturesOfEachFormatBeyondALimit) {
  std::vector<piko::scene::Color> pixels(64 * 64);
  std::mt19937 random; // for what compresses would fit
  for (piko::scene::Color &pixel : pixels)
    pixel.rgba.r = float(random() % 256) / 255;
  for (const char *format : {"png", "jpg", "tif", "exr", "bmp", "ppm", "hdr",
                             "tga", "webp", "gif"}) {
    std::string path = folder / (std::string("a.") + format);
    ASSERT_TRUE(writeImage(path, 1, 1, std::span(pixels).first(1))) << format;
    std::string old = read(path);
    {
      SizeLimit limit(1024);
      EXPECT_FALSE(writeImage(path, 64, 64, pixels)) << format;
    }
    EXPECT_EQ(read(path), old) << format;
  }
  EXPECT_EQ(countFiles(), 10);
}

TEST_F(OutputFile, PlacesThatCannotBeWritten) {
  ASSERT_TRUE(writeFile(folder / "a.txt", "old"));
  for (const std::string &path :
       {folder.string(), (folder / "none/a.txt").string(),
        (folder / "a.txt/b.txt").string(),
        (folder / std::string(256, 'n')).string(), std::string("/dev/full"),
        std::string()})
    EXPECT_FALSE(writeFile(path, "text")) << path;
  EXPECT_TRUE(writeFile(folder / std::string(255, 'n'), "text"));
  EXPECT_TRUE(writeFile("/dev/null", "text"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(countFiles(), 2);
}

TEST_F(OutputFile, PipesAreWrittenDirectly) {
  std::string path = folder / "pipe";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read(path); });
  EXPECT_TRUE(writeFile(path, "text"));
  reader.join();
  EXPECT_EQ(got, "text");
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST_F(OutputFile, SeveralAppearTogether) {
  std::string a = folder / "a.txt", b = folder / "b.txt";
  ASSERT_TRUE(writeFile(a, "old"));
  {
    OutputFiles files;
    ASSERT_TRUE(files.add(a, "new"));
    ASSERT_TRUE(files.add(b, "new"));
    EXPECT_EQ(read(a), "old");
    EXPECT_FALSE(fs::exists(b));
    ASSERT_TRUE(files.keep());
    EXPECT_EQ(read(a), "new");
    EXPECT_EQ(read(b), "new");
  }
  {
    OutputFiles files;
    ASSERT_TRUE(files.add(a, "newer"));
    auto ok = files.add(folder / "none/c.txt", "newer");
    ASSERT_FALSE(ok);
    EXPECT_EQ(ok.error().message, "cannot write '" +
                                      (folder / "none/c.txt").string() +
                                      "': No such file or directory");
  }
  {
    OutputFiles files; // what fails at the end takes nothing along
    ASSERT_TRUE(files.add(a, "newer"));
    ASSERT_TRUE(files.add("/dev/full", "newer"));
    EXPECT_FALSE(files.keep());
  }
  EXPECT_EQ(read(a), "new");
  EXPECT_EQ(countFiles(), 2);
}

TEST_F(OutputFile, LeavesSignalsAsTheyAre) {
  sigset_t before, after;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  ASSERT_TRUE(writeFile(folder / "a.txt", "text"));
  pthread_sigmask(SIG_SETMASK, nullptr, &after);
  for (int number = 1; number < 32; ++number)
    EXPECT_EQ(sigismember(&before, number), sigismember(&after, number));
}

} // namespace
