//===- PatchFile.cpp - Bezier patches from .bpt files ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "PatchFile.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <string>

using namespace piko;
using namespace piko::render;

namespace {

/// Reads numbers one by one; the first problem is kept.
class Reader {
public:
  explicit Reader(std::string_view text) : rest(text) {}

  Result<std::vector<scene::Patch>> read() {
    auto count = number<int64_t>("the number of patches");
    if (problem.empty() && (count < 1 || count > maxPatches))
      fail("expected from 1 to 2^31 - 1 patches, but got " +
           std::to_string(count));
    std::vector<scene::Patch> patches;
    for (int64_t i = 0; i < count && problem.empty(); ++i)
      patches.push_back(readPatch(int32_t(i)));
    if (problem.empty() && skipSpace())
      fail("expected the file to end after " + std::to_string(count) +
           " patches, but got '" + word() + "'");
    if (!problem.empty())
      return Error{"line " + std::to_string(line) + ": " + problem};
    return patches;
  }

private:
  static constexpr int64_t maxPatches = std::numeric_limits<int32_t>::max();

  scene::Patch readPatch(int32_t index) {
    scene::Patch patch{.points = {}, .index = index};
    auto u = number<int64_t>("a degree along u");
    auto v = number<int64_t>("a degree along v");
    if (problem.empty() && (u != 3 || v != 3))
      fail("expected a bicubic patch, but got the degrees " +
           std::to_string(u) + " and " + std::to_string(v));
    for (glm::vec3 &point : patch.points)
      for (int k = 0; k < 3; ++k)
        point[k] = number<float>("a coordinate");
    return patch;
  }

  /// The next number; 0 if there was a problem.
  template <class T> T number(const char *what) {
    T value{};
    if (!problem.empty())
      return value;
    if (!skipSpace()) {
      fail(std::string("expected ") + what + ", but the file ends");
      return value;
    }
    std::string text = word();
    auto [end, error] =
        std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() ||
        !std::isfinite(double(value))) {
      fail(std::string("expected ") + what + ", but got '" +
           text.substr(0, 40) + "'");
      return T{};
    }
    rest.remove_prefix(text.size());
    return value;
  }

  /// Goes to the next word, if there is one.
  bool skipSpace() {
    size_t next = rest.find_first_not_of(" \t\r\n");
    for (char c : rest.substr(0, next))
      if (c == '\n' && next != std::string_view::npos)
        ++line;
    rest.remove_prefix(std::min(next, rest.size()));
    return !rest.empty();
  }
  /// The word that follows.
  std::string word() const {
    return std::string(rest.substr(0, rest.find_first_of(" \t\r\n")));
  }

  void fail(const std::string &message) {
    if (problem.empty())
      problem = message;
  }

  std::string_view rest;
  int64_t line = 1;
  std::string problem;
};

} // namespace

Result<std::vector<scene::Patch>> render::readPatches(std::string_view text) {
  return Reader(text).read();
}
