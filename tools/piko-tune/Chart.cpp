//===- Chart.cpp - Error against time, as SVG -----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace piko;
using namespace piko::tune;

namespace {

struct Point {
  double ms, error;
  const Trial *trial;
};

/// Where numbers are on the page, in pixels. Errors are by decades, 0 below the
/// last of them.
struct Scales {
  double mostMs = 1e-3;
  int leastDecade = -3, mostDecade = -3;

  static constexpr double left = 80, top = 40, width = 560, height = 360;
  double x(double ms) const { return left + width * ms / mostMs; }
  double y(double error) const {
    double decade = error > 0 ? std::log10(error) : leastDecade - 1;
    double part = (decade - leastDecade + 1) / (mostDecade - leastDecade + 1);
    return top + height * (1 - std::clamp(part, 0.0, 1.0));
  }
  void add(double ms, double error) {
    mostMs = std::max(mostMs, 1.05 * ms);
    if (error <= 0)
      return;
    leastDecade =
        std::clamp(int(std::floor(std::log10(error))), -12, leastDecade);
    mostDecade = std::max(mostDecade, int(std::ceil(std::log10(error))));
  }
};

} // namespace

template <class... Args>
static std::string print(const char *format, Args... args) {
  char text[512];
  std::snprintf(text, sizeof text, format, args...);
  return text;
}

static std::string escape(const std::string &text) {
  std::string escaped;
  for (char c : text)
    escaped += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return escaped;
}

static std::string write(double x, double y, const char *anchor,
                         const std::string &text) {
  return print("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y,
               anchor) +
         escape(text) + "</text>\n";
}

/// A step of 1, 2 or 5 by which an axis has at most six.
static double findStep(double most) {
  double step = std::pow(10, std::floor(std::log10(most)));
  while (most / step > 6)
    step *= 2.5;
  while (most / step < 2.5)
    step /= 2;
  return step;
}

static std::string drawAxes(const Scales &scales) {
  double right = scales.left + scales.width,
         bottom = scales.top + scales.height;
  std::string svg = print("<path d=\"M%.1f %.1fV%.1fH%.1f\" fill=\"none\" "
                          "stroke=\"black\"/>\n",
                          scales.left, scales.top, bottom, right);
  for (double ms = 0, step = findStep(scales.mostMs); ms <= scales.mostMs;
       ms += step)
    svg += write(scales.x(ms), bottom + 18, "middle", print("%.3g", ms));
  svg += write(scales.left - 8, bottom + 4, "end", "0");
  for (int decade = scales.leastDecade; decade <= scales.mostDecade; ++decade)
    svg += write(scales.left - 8, scales.y(std::pow(10, decade)) + 4, "end",
                 print("1e%d", decade));
  return svg + write(right, bottom + 36, "end", "milliseconds a frame");
}

/// The line along the points that no other one beats in both.
static std::string drawFront(std::vector<Point> points, const Scales &scales) {
  std::sort(points.begin(), points.end(), [](const Point &a, const Point &b) {
    return std::pair(a.ms, a.error) < std::pair(b.ms, b.error);
  });
  std::string path;
  double least = INFINITY;
  for (const Point &point : points) {
    if (point.error >= least)
      continue;
    path +=
        path.empty()
            ? print("M%.1f %.1f", scales.x(point.ms), scales.y(point.error))
            : print("H%.1fV%.1f", scales.x(point.ms), scales.y(point.error));
    least = point.error;
  }
  return "<path class=\"front\" d=\"" + path +
         "\" fill=\"none\" stroke=\"#1f77b4\"/>\n";
}

static std::string drawPoint(const Point &point, const TuneResult &result,
                             const Scales &scales) {
  const Outcome &outcome = result.outcome;
  bool isChosen = point.trial == outcome.chosen;
  const char *fill = isChosen                        ? "#d62728"
                     : point.trial == outcome.text   ? "black"
                     : !point.trial->problem.empty() ? "none"
                                                     : "#1f77b4";
  std::string svg =
      print("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%d\" fill=\"%s\" "
            "stroke=\"%s\"><title>",
            scales.x(point.ms), scales.y(point.error), isChosen ? 6 : 3, fill,
            isChosen ? "#d62728" : "#1f77b4");
  return svg + escape(result.space.name(point.trial->setting)) +
         print(": %.3g ms, error %.3g", point.ms, point.error) +
         "</title></circle>\n";
}

std::string tune::drawChart(const TuneResult &result) {
  std::vector<Point> points;
  Scales scales;
  scales.add(0, result.options.error);
  auto add = [&](const Trial &trial) {
    if (trial.times.empty() || !trial.error)
      return;
    points.push_back({trial.median(), *trial.error, &trial});
    scales.add(trial.median(), *trial.error);
  };
  for (const Trial &trial : result.trials)
    if (&trial != result.outcome.chosen)
      add(trial);
  add(*result.outcome.chosen); // above all others
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"680\" "
                    "height=\"460\" font-family=\"sans-serif\" "
                    "font-size=\"12\">\n<rect width=\"680\" height=\"460\" "
                    "fill=\"white\"/>\n";
  std::string title = "error (" + result.options.metricName +
                      ") against time; chosen, red: " +
                      result.space.name(result.outcome.chosen->setting);
  svg += write(scales.left, 24, "start", title) + drawAxes(scales);
  double limit = scales.y(result.options.error);
  svg += print("<path d=\"M%.1f %.1fH%.1f\" stroke=\"gray\" "
               "stroke-dasharray=\"4\"/>\n",
               scales.left, limit, scales.left + scales.width);
  svg += drawFront(points, scales);
  for (const Point &point : points)
    svg += drawPoint(point, result, scales);
  return svg + "</svg>\n";
}
