//===- Failure.h - Where methods fail ---------------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A failure mode is a family of scenes that become harder, a naive method that
// fails on them, and ours. A test asserts that the one fails and the other does
// not; `FailureTests --charts FOLDER` writes error against hardness instead,
// and what the methods draw.
//
//===----------------------------------------------------------------------===//
#ifndef UNITTESTS_FAILURES_FAILURE_H
#define UNITTESTS_FAILURES_FAILURE_H

#include "Piko/Scene/Image.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace failures {

using piko::render::Image;

/// What methods are told of a failure mode.
struct Description {
  std::string name;           ///< "SharedEdges", as the test
  std::string title;          ///< of its chart
  std::string hardness;       ///< what its scenes have more of, with the unit
  std::string error;          ///< what is wrong with a result, with the unit
  std::string naive, ours;    ///< the methods
  std::vector<double> scenes; ///< by hardness
};

/// How wrong both methods are.
struct Errors {
  double naive, ours;
};

/// What both draw.
struct Pictures {
  Image naive, ours;
};

class Mode {
public:
  virtual ~Mode() = default;
  virtual Description describe() const = 0;
  virtual Errors measure(double hardness) const = 0;
  /// Of the scene that shows it best; empty if there is nothing to see.
  virtual Pictures draw() const { return {}; }
};

/// All modes, in the order of their names.
std::vector<std::unique_ptr<Mode>> &getModes();

template <class M> struct Registration {
  Registration() { getModes().push_back(std::make_unique<M>()); }
};

inline piko::scene::Color rgb(float red, float green, float blue) {
  return {{red, green, blue, 1}};
}

/// An image whose pixels are colours of (x, y).
template <class F> Image paint(int width, int height, F color) {
  Image image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.pixels.push_back(color(x, y));
  return image;
}

} // namespace failures

#endif // UNITTESTS_FAILURES_FAILURE_H
