//===- piko-diff.cpp - Measure how far images are from another one --------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/CommandLine.h"
#include "Piko/CommandLine/Progress.h"
#include "Piko/Scene/ImageError.h"
#include "Piko/Scene/ImageFile.h"
#include "Piko/Scene/Json.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>

using namespace piko;
using namespace piko::render;

namespace {

struct Options {
  std::string help; ///< the text, if that is asked for
  bool json = false;
  std::string reference, image, map;
  double pixelsPerDegree = usualPixelsPerDegree;
  double failAbove = INFINITY;
};

Result<Options> parseOptions(const std::vector<std::string> &words) {
  CommandLine line(
      "piko-diff [options] REFERENCE IMAGE",
      "Measures how far an image is from another one, in r, g and b as a "
      "display shows them: the largest, the mean and the root mean square "
      "absolute difference, the 99th percentile of pixels, PSNR in dB, and the "
      "mean of FLIP, which predicts what an observer notices. Black to white "
      "is 1. Colours are taken as the files have them; alpha is not compared.",
      "piko-diff reference.png image.png --fail-above 0");
  Options options;
  CLI::Option *files[] = {
      line.addText("REFERENCE", "", options.reference, "what is right"),
      line.addText("IMAGE", "", options.image, "what is measured")};
  line.addText("--map", "FILE", options.map,
               "write FLIP of each pixel, from black (equal) by red and yellow "
               "to white");
  line.addNumber("--pixels-per-degree", "P", options.pixelsPerDegree,
                 "how finely an observer sees the images (67.02: a display of "
                 "3840 pixels, 0.7 m wide, from 0.7 m)",
                 0.001, 10000);
  line.add_flag("--json", options.json, "print one line of JSON");
  line.addNumber("--fail-above", "E", options.failAbove,
                 "exit with 1 if the largest difference is above E", 0);
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  size_t count = files[0]->count() + files[1]->count();
  if (options.help.empty() && count != 2)
    return Error{"expected two images, but got " + std::to_string(count)};
  return options;
}

/// Black by red and yellow to white.
scene::Color heat(float value) {
  auto part = [&](float from) {
    return std::clamp(3 * value - from, 0.0f, 1.0f);
  };
  return {{part(0), part(1), part(2), 1}};
}

Result<Done> writeMap(const Options &options, const Image &image,
                      const std::vector<float> &flip) {
  std::vector<scene::Color> pixels(flip.size());
  std::transform(flip.begin(), flip.end(), pixels.begin(), heat);
  return writeImage(options.map, image.width, image.height, pixels);
}

std::string describe(const Options &options, const ImageError &error) {
  if (options.json)
    return writeLine(Json::object({{"largest", error.largest},
                                   {"mean", error.mean},
                                   {"rms", error.rms},
                                   {"p99", error.p99},
                                   {"psnr", error.psnr},
                                   {"flip", error.flip},
                                   {"differing", error.differing},
                                   {"not_finite", error.notFinite}}));
  char text[256];
  std::snprintf(text, sizeof text,
                "largest %.6g, mean %.6g, rms %.6g, 99%% of pixels %.6g, "
                "PSNR %.2f dB, FLIP %.6g, %lld pixels differ",
                error.largest, error.mean, error.rms, error.p99, error.psnr,
                error.flip, static_cast<long long>(error.differing));
  std::string line = text;
  if (error.notFinite > 0)
    line += ", " + std::to_string(error.notFinite) + " are not finite";
  return line;
}

/// Whether the images are near enough.
Result<bool> compareFiles(const Options &options) {
  if (!options.map.empty())
    if (auto ok = checkImageFormat(options.map); !ok)
      return ok.error();
  auto read = [](const std::string &path) {
    Progress progress("loading " + path);
    return readImage(path);
  };
  auto reference = read(options.reference);
  if (!reference)
    return reference.error();
  auto image = read(options.image);
  if (!image)
    return image.error();
  std::vector<float> flip;
  std::optional<Progress> progress("comparing " + options.image);
  auto error =
      compareImages(*reference, *image, options.pixelsPerDegree, &flip);
  progress.reset();
  if (!error)
    return Error{"'" + options.reference + "' and '" + options.image +
                 "': " + error.error().message};
  if (!options.map.empty())
    if (auto ok = writeMap(options, *image, flip); !ok)
      return ok.error();
  std::printf("%s\n", describe(options, *error).c_str());
  if (auto ok = support::finishOutput(); !ok)
    return ok.error();
  return error->largest <= options.failAbove;
}

int fail(const Error &error) {
  std::fprintf(stderr, "piko-diff: error: %s\n", error.message.c_str());
  return 2;
}

} // namespace

int main(int argc, char **argv) {
  piko::support::reportOutOfMemory("piko-diff");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  auto options = parseOptions({argv + 1, argv + argc});
  if (!options)
    return fail(options.error());
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto ok = support::finishOutput();
    return ok ? 0 : fail(ok.error());
  }
  auto isNear = compareFiles(*options);
  if (!isNear)
    return fail(isNear.error());
  return *isNear ? 0 : 1;
}
