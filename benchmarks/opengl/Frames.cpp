//===- Frames.cpp - How long frames take ----------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Frames.h"

#include <algorithm>
#include <chrono>

using namespace piko;
using namespace piko::peer;

namespace {

class Stopwatch {
public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start)
        .count();
  }

private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start = Clock::now();
};

Times summarize(std::vector<double> times) {
  std::ranges::sort(times);
  return {times[times.size() / 2], times.front(), times.back()};
}

} // namespace

Result<FrameTimes> peer::timeFrames(const GL &gl, const Drawing &drawing,
                                    bool isSoftware,
                                    const FrameOptions &options) {
  GLint bits = 0;
  gl.GetQueryiv(GL_TIME_ELAPSED, GL_QUERY_COUNTER_BITS, &bits);
  if (bits == 0)
    return Error{"expected a driver that measures time"};
  GLuint query = 0;
  gl.GenQueries(1, &query);

  double limit = 1000 * options.seconds;
  Stopwatch warmup;
  for (int i = 0; i < options.warmup && warmup.milliseconds() < limit / 4;
       ++i) {
    drawing.draw();
    gl.Finish();
  }
  std::vector<double> device, wall;
  double spent = 0;
  while (int(wall.size()) < options.frames &&
         (wall.size() < 3 || spent < limit)) {
    Stopwatch frame;
    gl.BeginQuery(GL_TIME_ELAPSED, query);
    drawing.draw();
    gl.EndQuery(GL_TIME_ELAPSED);
    gl.Finish();
    wall.push_back(frame.milliseconds());
    spent += wall.back();
    GLuint64 nanoseconds = 0;
    gl.GetQueryObjectui64v(query, GL_QUERY_RESULT, &nanoseconds);
    device.push_back(double(nanoseconds) / 1e6);
  }
  if (auto ok = gl.check("drawing"); !ok)
    return ok.error();
  return FrameTimes{summarize(isSoftware ? wall : device), summarize(wall),
                    int(wall.size())};
}
