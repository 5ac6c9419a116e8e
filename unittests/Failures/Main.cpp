//===- Main.cpp - Tests of failure modes, or their charts -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// FailureTests [options of googletest]
// FailureTests --charts FOLDER [--only NAME]...
//
// The second one writes FOLDER/failures.csv, a line for each mode and scene,
// and FOLDER/NAME-naive.png and NAME-ours.png.
//
//===----------------------------------------------------------------------===//
#include "Failure.h"

#include "Piko/Scene/ImageFile.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

namespace failures {

std::vector<std::unique_ptr<Mode>> &getModes() {
  static std::vector<std::unique_ptr<Mode>> modes;
  return modes;
}

static std::string quote(const std::string &text) {
  std::string quoted = "\"";
  for (char c : text)
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

static void writeScenes(std::ostream &csv, const Mode &mode) {
  Description d = mode.describe();
  for (double scene : d.scenes) {
    Errors errors = mode.measure(scene);
    csv << d.name << ',' << quote(d.title) << ',' << quote(d.hardness) << ','
        << quote(d.error) << ',' << quote(d.naive) << ',' << quote(d.ours)
        << ',' << scene << ',' << errors.naive << ',' << errors.ours << '\n';
  }
}

static void writePicture(const Image &image, const std::string &file) {
  if (image.pixels.empty())
    return;
  auto done =
      piko::render::writeImage(file, image.width, image.height, image.pixels);
  if (!done)
    throw std::runtime_error(done.error().message);
}

static void writeCharts(const std::filesystem::path &folder,
                        const std::vector<std::string> &only) {
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder / "failures.csv");
  csv.precision(9);
  csv << "mode,title,hardness,error,naive,ours,scene,naive error,our error\n";
  std::sort(getModes().begin(), getModes().end(), [](auto &a, auto &b) {
    return a->describe().name < b->describe().name;
  });
  for (const auto &mode : getModes()) {
    std::string name = mode->describe().name;
    if (!only.empty() &&
        std::find(only.begin(), only.end(), name) == only.end())
      continue;
    writeScenes(csv, *mode);
    Pictures pictures = mode->draw();
    writePicture(pictures.naive, folder / (name + "-naive.png"));
    writePicture(pictures.ours, folder / (name + "-ours.png"));
  }
  if (!csv.flush())
    throw std::runtime_error("cannot write " +
                             (folder / "failures.csv").string());
}

} // namespace failures

int main(int count, char **arguments) {
  testing::InitGoogleTest(&count, arguments);
  if (count == 1)
    return RUN_ALL_TESTS();
  std::vector<std::string> words(arguments + 1, arguments + count), only;
  for (size_t i = 2; i + 1 < words.size() && words[i] == "--only"; i += 2)
    only.push_back(words[i + 1]);
  if (words.size() != 2 + 2 * only.size() || words[0] != "--charts") {
    std::fprintf(stderr,
                 "usage: FailureTests [--charts FOLDER [--only NAME]...]\n");
    return 2;
  }
  try {
    failures::writeCharts(words[1], only);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "FailureTests: %s\n", error.what());
    return 1;
  }
}
