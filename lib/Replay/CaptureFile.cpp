// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Files that pikort_capture has written.

#include "Piko/Replay/CaptureFile.h"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>

using namespace piko;
using namespace piko::replay;

bool replay::isCaptureFile(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  std::string begin(rt::captureMagic.size(), '\0');
  file.read(begin.data(), std::streamsize(begin.size()));
  return file && rt::Capture::isCapture(begin);
}

support::Result<rt::Capture> replay::readCapture(const std::string &path) {
  auto fail = [&](const std::string &why) {
    return support::Error{"cannot read capture '" + path + "': " + why};
  };
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad())
    return fail(std::generic_category().message(errno ? errno : EIO));
  rt::Capture capture;
  if (std::string wrong = capture.read(content); !wrong.empty())
    return fail(wrong);
  return capture;
}
