//===- ImageError.cpp - How far an image is from another one --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Scene/ImageError.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace piko;
using namespace piko::render;

/// As a display shows it.
static float shown(float value) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : 0.0f;
}

static Result<Done> checkSizes(const Image &reference, const Image &image) {
  auto sizeOf = [](const Image &i) {
    return std::to_string(i.width) + " x " + std::to_string(i.height);
  };
  if (reference.width != image.width || reference.height != image.height)
    return Error{"expected images of one size, but got " + sizeOf(reference) +
                 " and " + sizeOf(image)};
  size_t count = size_t(std::max(image.width, 0)) * std::max(image.height, 0);
  if (count == 0 || reference.pixels.size() != count ||
      image.pixels.size() != count)
    return Error{"expected images that have pixels"};
  return Done{};
}

//===----------------------------------------------------------------------===//
// FLIP
//===----------------------------------------------------------------------===//

namespace {

/// Three numbers of a pixel: of a colour space that the context says.
struct Triple {
  double x = 0, y = 0, z = 0;
};

/// A plane of numbers, which go on at the borders.
struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;

  Plane(int width, int height)
      : width(width), height(height), values(size_t(width) * height) {}
  float &at(int x, int y) { return values[size_t(y) * width + x]; }
  float at(int x, int y) const { return values[size_t(y) * width + x]; }
};

/// Weights for -radius to radius.
using Kernel = std::vector<double>;

constexpr double pi = 3.14159265358979323846;

} // namespace

static double toLinear(double s) {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

/// CIE XYZ of linear sRGB.
static Triple toXYZ(Triple c) {
  return {0.4123908 * c.x + 0.3575843 * c.y + 0.1804808 * c.z,
          0.2126390 * c.x + 0.7151687 * c.y + 0.0721923 * c.z,
          0.0193308 * c.x + 0.1191948 * c.y + 0.9505322 * c.z};
}

static Triple fromXYZ(Triple c) {
  return {3.2409699 * c.x - 1.5373832 * c.y - 0.4986108 * c.z,
          -0.9692436 * c.x + 1.8759675 * c.y + 0.0415551 * c.z,
          0.0556301 * c.x - 0.2039770 * c.y + 1.0569715 * c.z};
}

static Triple whitePoint() { return toXYZ({1, 1, 1}); }

/// The opponent space Y Cx Cz.
static Triple toOpponent(Triple xyz) {
  Triple white = whitePoint();
  double x = xyz.x / white.x, y = xyz.y / white.y, z = xyz.z / white.z;
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

static Triple fromOpponent(Triple c) {
  Triple white = whitePoint();
  double y = (c.x + 16) / 116;
  return {(c.y / 500 + y) * white.x, y * white.y, (y - c.z / 200) * white.z};
}

/// CIE L*a*b*, with the effect that Hunt found: chroma grows with lightness.
static Triple toAdjustedLab(Triple linear) {
  Triple white = whitePoint(), xyz = toXYZ(linear);
  auto f = [](double t) {
    constexpr double d = 6.0 / 29;
    return t > d * d * d ? std::cbrt(t) : t / (3 * d * d) + 4.0 / 29;
  };
  double x = f(xyz.x / white.x), y = f(xyz.y / white.y), z = f(xyz.z / white.z);
  double lightness = 116 * y - 16;
  return {lightness, 0.01 * lightness * 500 * (x - y),
          0.01 * lightness * 200 * (y - z)};
}

/// The distance HyAB, by which colours that are far apart differ, to a power.
static double colorDistance(Triple a, Triple b) {
  constexpr double power = 0.7;
  return std::pow(std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z),
                  power);
}

/// Adds a plane, filtered along x and along y, with a weight.
static void addFiltered(const Plane &from, const Kernel &alongX,
                        const Kernel &alongY, double weight, Plane &to) {
  auto filter = [&](auto read, const Kernel &kernel, int at, int end) {
    int first = at - int(kernel.size() / 2);
    double sum = 0;
    for (size_t i = 0; i < kernel.size(); ++i)
      sum += kernel[i] * read(std::clamp(first + int(i), 0, end - 1));
    return sum;
  };
  Plane rows(from.width, from.height);
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x)
      rows.at(x, y) = float(
          filter([&](int i) { return from.at(i, y); }, alongX, x, from.width));
  for (int y = 0; y < from.height; ++y)
    for (int x = 0; x < from.width; ++x)
      to.at(x, y) += float(weight * filter([&](int i) { return rows.at(x, i); },
                                           alongY, y, from.height));
}

template <class Function> static Kernel makeKernel(int radius, Function f) {
  Kernel kernel;
  for (int i = -radius; i <= radius; ++i)
    kernel.push_back(f(double(i)));
  return kernel;
}

static double sumOf(const Kernel &kernel) {
  double sum = 0;
  for (double weight : kernel)
    sum += weight;
  return sum;
}

//===----------------------------------------------------------------------===//
// Colours
//===----------------------------------------------------------------------===//

namespace {

/// How sensitive an eye is to contrasts of a channel: a sum of two Gaussians of
/// the angle, a * sqrt(pi / b) * exp(-(pi * angle)^2 / b).
struct Sensitivity {
  double a1, b1, a2, b2;
};

constexpr Sensitivity achromatic{1, 0.0047, 0, 1e-5},
    redGreen{1, 0.0053, 0, 1e-5}, blueYellow{34.1, 0.04, 13.5, 0.025};

/// What of an image its colours and its features are compared by.
struct Channels {
  Plane luminance, x, z; ///< Y, Cx, Cz
};

} // namespace

static Plane filterBy(const Plane &plane, const Sensitivity &s,
                      double pixelsPerDegree) {
  double widest = std::max({achromatic.b1, redGreen.b1, blueYellow.b1});
  int radius =
      int(std::ceil(3 * std::sqrt(widest / (2 * pi * pi)) * pixelsPerDegree));
  auto gaussian = [&](double b) {
    return makeKernel(radius, [&](double i) {
      double angle = i / pixelsPerDegree;
      return std::exp(-pi * pi * angle * angle / b);
    });
  };
  Kernel first = gaussian(s.b1), second = gaussian(s.b2);
  double weight1 = s.a1 * std::sqrt(pi / s.b1),
         weight2 = s.a2 * std::sqrt(pi / s.b2);
  double sum1 = sumOf(first), sum2 = sumOf(second);
  double total = weight1 * sum1 * sum1 + weight2 * sum2 * sum2;
  Plane filtered(plane.width, plane.height);
  addFiltered(plane, first, first, weight1 / total, filtered);
  if (s.a2 != 0)
    addFiltered(plane, second, second, weight2 / total, filtered);
  return filtered;
}

static Channels toChannels(const Image &image) {
  Plane empty(image.width, image.height);
  Channels channels{empty, empty, empty};
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const auto &rgba = image.pixels[i].rgba;
    Triple c =
        toOpponent(toXYZ({toLinear(shown(rgba.r)), toLinear(shown(rgba.g)),
                          toLinear(shown(rgba.b))}));
    channels.luminance.values[i] = float(c.x);
    channels.x.values[i] = float(c.y);
    channels.z.values[i] = float(c.z);
  }
  return channels;
}

/// What an eye sees of an image, in adjusted L*a*b*.
static std::vector<Triple> perceive(const Channels &channels,
                                    double pixelsPerDegree) {
  Plane y = filterBy(channels.luminance, achromatic, pixelsPerDegree),
        x = filterBy(channels.x, redGreen, pixelsPerDegree),
        z = filterBy(channels.z, blueYellow, pixelsPerDegree);
  std::vector<Triple> colors(y.values.size());
  for (size_t i = 0; i < colors.size(); ++i) {
    Triple linear =
        fromXYZ(fromOpponent({y.values[i], x.values[i], z.values[i]}));
    colors[i] = toAdjustedLab({std::clamp(linear.x, 0.0, 1.0),
                               std::clamp(linear.y, 0.0, 1.0),
                               std::clamp(linear.z, 0.0, 1.0)});
  }
  return colors;
}

/// Small differences are spread over most of [0, 1], as they matter more.
static double compressColor(double distance) {
  constexpr double part = 0.4, to = 0.95;
  static const double most =
      colorDistance(toAdjustedLab({0, 1, 0}), toAdjustedLab({0, 0, 1}));
  double knee = part * most;
  return distance < knee ? distance * to / knee
                         : to + (distance - knee) / (most - knee) * (1 - to);
}

//===----------------------------------------------------------------------===//
// Features
//===----------------------------------------------------------------------===//

namespace {

/// How strong edges and points are.
struct Features {
  std::vector<double> edges, points;
};

} // namespace

/// By derivatives of a Gaussian as wide as what an eye detects, 0.082 degrees.
static Features findFeatures(const Plane &luminance, double pixelsPerDegree) {
  constexpr double width = 0.082;
  double deviation = 0.5 * width * pixelsPerDegree;
  int radius = int(std::ceil(3 * deviation));
  auto gaussian = [&](double x) {
    return std::exp(-x * x / (2 * deviation * deviation));
  };
  Kernel smooth = makeKernel(radius, gaussian);
  Kernel first = makeKernel(radius, [&](double x) { return -x * gaussian(x); });
  Kernel second = makeKernel(radius, [&](double x) {
    return (x * x / (deviation * deviation) - 1) * gaussian(x);
  });
  // Weights of either sign sum to 1.
  auto normalize = [&](Kernel &kernel) {
    double positive = 0, negative = 0;
    for (double weight : kernel)
      (weight > 0 ? positive : negative) += std::abs(weight);
    for (double &weight : kernel)
      if (weight != 0)
        weight /= weight > 0 ? positive : negative;
  };
  double sum = sumOf(smooth);
  for (double &weight : smooth)
    weight /= sum;
  normalize(first);
  normalize(second);
  Plane normal = luminance;
  for (float &value : normal.values)
    value = (value + 16) / 116;
  auto strength = [&](const Kernel &kernel) {
    Plane x(normal.width, normal.height), y = x;
    addFiltered(normal, kernel, smooth, 1, x);
    addFiltered(normal, smooth, kernel, 1, y);
    std::vector<double> lengths(x.values.size());
    for (size_t i = 0; i < lengths.size(); ++i)
      lengths[i] = std::hypot(double(x.values[i]), double(y.values[i]));
    return lengths;
  };
  return {strength(first), strength(second)};
}

Result<std::vector<float>> render::computeFlip(const Image &reference,
                                               const Image &image,
                                               double pixelsPerDegree) {
  if (auto ok = checkSizes(reference, image); !ok)
    return ok.error();
  constexpr double mostPixels = 1e4;
  if (!(pixelsPerDegree > 0 && pixelsPerDegree <= mostPixels))
    return Error{"expected between 0 and 10000 pixels per degree"};
  Channels a = toChannels(reference), b = toChannels(image);
  std::vector<Triple> colorsA = perceive(a, pixelsPerDegree),
                      colorsB = perceive(b, pixelsPerDegree);
  Features featuresA = findFeatures(a.luminance, pixelsPerDegree),
           featuresB = findFeatures(b.luminance, pixelsPerDegree);
  std::vector<float> map(colorsA.size());
  for (size_t i = 0; i < map.size(); ++i) {
    double color = compressColor(colorDistance(colorsA[i], colorsB[i]));
    double feature =
        std::max(std::abs(featuresA.edges[i] - featuresB.edges[i]),
                 std::abs(featuresA.points[i] - featuresB.points[i]));
    feature = std::sqrt(std::min(feature / std::sqrt(2.0), 1.0));
    map[i] = float(std::pow(std::min(color, 1.0), 1 - feature));
  }
  return map;
}

//===----------------------------------------------------------------------===//
// All measures
//===----------------------------------------------------------------------===//

Result<ImageError> render::compareColors(const Image &reference,
                                         const Image &image) {
  if (auto ok = checkSizes(reference, image); !ok)
    return ok.error();
  ImageError error;
  double sum = 0, squares = 0;
  std::vector<float> worst(image.pixels.size());
  for (size_t i = 0; i < worst.size(); ++i) {
    bool isFinite = true;
    for (int channel = 0; channel < 3; ++channel) {
      float value = image.pixels[i].rgba[channel];
      isFinite &= std::isfinite(value);
      double difference = std::abs(double(shown(value)) -
                                   shown(reference.pixels[i].rgba[channel]));
      sum += difference;
      squares += difference * difference;
      worst[i] = std::max(worst[i], float(difference));
    }
    error.notFinite += !isFinite;
    error.differing += worst[i] > 0;
  }
  double count = double(worst.size());
  auto rank = worst.begin() + std::ptrdiff_t(std::ceil(0.99 * count)) - 1;
  std::nth_element(worst.begin(), rank, worst.end());
  error.p99 = *rank;
  error.largest = *std::max_element(rank, worst.end());
  error.mean = sum / (3 * count);
  error.rms = std::sqrt(squares / (3 * count));
  error.psnr = squares > 0 ? -20 * std::log10(error.rms)
                           : std::numeric_limits<double>::infinity();
  return error;
}

Result<ImageError> render::compareImages(const Image &reference,
                                         const Image &image,
                                         double pixelsPerDegree,
                                         std::vector<float> *flip) {
  auto map = computeFlip(reference, image, pixelsPerDegree);
  if (!map)
    return map.error();
  auto error = compareColors(reference, image);
  if (!error)
    return error;
  double sum = 0;
  for (float value : *map)
    sum += value;
  error->flip = sum / double(map->size());
  if (flip)
    *flip = std::move(*map);
  return error;
}
