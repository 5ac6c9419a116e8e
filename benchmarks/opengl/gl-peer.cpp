//===- gl-peer.cpp - The picture of a rasterizer by OpenGL ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The obvious peer of examples/raster and examples/visibility: the same scene,
// camera and lights, drawn and timed by the card's own rasterizer.
//
//===----------------------------------------------------------------------===//
#include "Comparison.h"
#include "EglContext.h"
#include "Frames.h"

#include "Frame.h"

#include "Piko/Scene/ImageFile.h"
#include "Piko/Scene/Json.h"
#include "Piko/Support/OutOfMemory.h"
#include "Piko/Support/OutputFile.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>

using namespace piko;
using namespace piko::peer;
using render::Json;

namespace {

/// Exit status where the machine lacks what is needed, and nothing is wrong.
constexpr int hasNoOpenGL = 3;

struct Options {
  std::string help; ///< the text, if that is asked for
  render::Options scene;
  ContextOptions context;
  FrameOptions frames;
  Technique technique = Technique::Forward;
  std::string image;     ///< to write
  std::string reference; ///< to compare with
};

struct Failure {
  std::string message;
  int status = 1;
};

std::optional<Failure> reportProblem(const Error &error, int status = 1) {
  return Failure{error.message, status};
}

void addOwnOptions(CommandLine &line, Options &options) {
  line.addText("SCENE", "", options.scene.scene, "the mesh to draw");
  line.addChoice(
      "--technique", "NAME",
      {{"forward", "shade what passes the test of depth when it is drawn"},
       {"prepass", "draw all depths first, then shade what is seen"}},
      [&](const std::string &name) {
        options.technique =
            name == "forward" ? Technique::Forward : Technique::Prepass;
      },
      "how (forward):");
  line.addNumber("--warmup", "N", options.frames.warmup, "untimed frames (5)",
                 0, 1'000'000'000);
  line.addNumber("--frames", "N", options.frames.frames, "timed frames (30)", 1,
                 1'000'000'000);
  line.addNumber("--seconds", "S", options.frames.seconds,
                 "stop early after so long, but with 3 timed frames at least "
                 "(1000)",
                 0);
  line.addText("--out", "IMAGE", options.image,
               "write the last frame: .png, or what else this build knows");
  line.addText("--compare", "FILE.png", options.reference,
               "count the pixels that differ from this picture's by more than "
               "2 of 255 in r, g or b");
  line.add_flag("--software", options.context.software,
                "draw by a renderer on the processor, such as Mesa's llvmpipe, "
                "and by no card");
  line.addNumber("--device", "N", options.context.cudaDevice,
                 "the CUDA device whose card it is, where EGL has it "
                 "($PIKO_CUDA_DEVICE; 0)",
                 0);
  line.addText("--egl-library", "FILE", options.context.library,
               "EGL's library (libEGL.so.1)");
}

/// What the environment says, which options change.
Result<Done> readEnvironment(Options &options) {
  const char *device = std::getenv("PIKO_CUDA_DEVICE");
  if (!device || !*device)
    return Done{};
  try {
    options.context.cudaDevice =
        CommandLine::readNumber<int>("PIKO_CUDA_DEVICE", device, 0);
  } catch (const CLI::ValidationError &error) {
    return Error{error.what()};
  }
  return Done{};
}

Result<Options> parseOptions(const std::vector<std::string> &words) {
  CommandLine line(
      "gl-peer [options] SCENE",
      "Draws by OpenGL what examples/raster and examples/visibility draw, "
      "without a window, and says how long a frame took: the last line is "
      "JSON, of which ms_* are times of the card and wall_ms_* of the host, "
      "which waits for each frame. Exit status 3: this machine has no EGL, or "
      "no OpenGL 4.3 by a card.",
      "gl-peer bunny.obj --lights 10 --compare bunny.png");
  Options options;
  if (auto ok = readEnvironment(options); !ok)
    return ok.error();
  addOwnOptions(line, options);
  render::addSizeOptions(line, options.scene);
  render::addViewOptions(line, options.scene);
  auto help = line.read(words);
  if (!help)
    return help.error();
  options.help = *help;
  if (options.help.empty() && options.scene.scene.empty())
    return Error{"expected a scene file"};
  return options;
}

Result<render::SceneInput> loadScene(const Options &options) {
  auto scene = render::loadScene(options.scene, "gl-peer");
  if (scene && scene->mesh.triangles.empty())
    return Error{"scene '" + options.scene.scene +
                 "': expected a mesh of triangles"};
  return scene;
}

/// The picture to compare with, which has the size of what is drawn; none if
/// that is not asked for.
Result<std::optional<render::Image>> loadReference(const Options &options) {
  if (options.reference.empty())
    return std::optional<render::Image>();
  auto image = readPNG(options.reference);
  if (!image)
    return image.error();
  const render::ViewOptions &view = options.scene.view;
  if (image->width != view.width || image->height != view.height)
    return Error{"--compare: expected " + std::to_string(view.width) + " x " +
                 std::to_string(view.height) + " pixels, but '" +
                 options.reference + "' has " + std::to_string(image->width) +
                 " x " + std::to_string(image->height)};
  return std::optional(std::move(*image));
}

void addTimes(Json &line, const std::string &prefix, const Times &times) {
  line[prefix + "ms_median"] = render::roundToThousandths(times.median);
  line[prefix + "ms_min"] = render::roundToThousandths(times.least);
  line[prefix + "ms_max"] = render::roundToThousandths(times.most);
}

Json makeReport(const Options &options, const render::SceneInput &scene,
                const EglContext &context, const FrameTimes &times) {
  Json line;
  line["peer"] = "opengl";
  line["technique"] =
      options.technique == Technique::Forward ? "forward" : "prepass";
  addTimes(line, "", times.device);
  addTimes(line, "wall_", times.wall);
  line["frames"] = times.count;
  line["tris"] = scene.mesh.triangles.size();
  line["lights"] = scene.lights.size();
  line["w"] = scene.size.x;
  line["h"] = scene.size.y;
  line["renderer"] = context.gl().text(GL_RENDERER);
  line["version"] = context.gl().text(GL_VERSION);
  line["device"] = context.device();
  return line;
}

/// Everything after the command line; what went wrong, if anything.
std::optional<Failure> draw(const Options &options) {
  if (!options.image.empty())
    if (auto ok = render::checkImageFormat(options.image); !ok)
      return reportProblem(ok.error());
  auto reference = loadReference(options);
  if (!reference)
    return reportProblem(reference.error());
  auto scene = loadScene(options);
  if (!scene)
    return reportProblem(scene.error());
  auto context = EglContext::create(options.context);
  if (!context)
    return reportProblem(context.error(), hasNoOpenGL);
  auto drawing = Drawing::create(context->gl(), *scene, options.technique);
  if (!drawing)
    return reportProblem(drawing.error());
  auto times = timeFrames(context->gl(), *drawing, options.context.software,
                          options.frames);
  if (!times)
    return reportProblem(times.error());
  auto image = drawing->read();
  if (!image)
    return reportProblem(image.error());
  if (!options.image.empty())
    if (auto ok = render::writeImage(options.image, image->width, image->height,
                                     image->pixels);
        !ok)
      return reportProblem(ok.error());

  Json line = makeReport(options, *scene, *context, *times);
  if (*reference) {
    Comparison comparison = compare(**reference, *image);
    line["differs"] = comparison.differing;
    line["largest"] = comparison.largest;
  }
  std::printf("%s\n", render::writeLine(line).c_str());
  if (auto ok = support::finishOutput(); !ok)
    return reportProblem(ok.error());
  return std::nullopt;
}

int fail(const Failure &failure) {
  std::fprintf(stderr, "gl-peer: error: %s\n", failure.message.c_str());
  return failure.status;
}

} // namespace

int main(int argc, char **argv) {
  support::reportOutOfMemory("gl-peer");
  std::signal(SIGXFSZ, SIG_IGN); // to write beyond a limit is an error
  auto options = parseOptions({argv + 1, argv + argc});
  if (!options)
    return fail({options.error().message});
  if (!options->help.empty()) {
    std::fputs(options->help.c_str(), stdout);
    auto ok = support::finishOutput();
    return ok ? 0 : fail({ok.error().message});
  }
  auto failure = draw(*options);
  return failure ? fail(*failure) : 0;
}
