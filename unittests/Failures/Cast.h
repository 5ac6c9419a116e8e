//===- Cast.h - A scene for pipelines that were compiled apart --*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The class of a compiled pipeline has types of its own, laid out as those of
// piko/scene.h.
//
//===----------------------------------------------------------------------===//
#ifndef UNITTESTS_FAILURES_CAST_H
#define UNITTESTS_FAILURES_CAST_H

#include <bit>
#include <vector>

namespace failures {

template <class To, class From>
std::vector<To> castAll(const std::vector<From> &from) {
  std::vector<To> to;
  to.reserve(from.size());
  for (const From &element : from)
    to.push_back(std::bit_cast<To>(element));
  return to;
}

} // namespace failures

#endif // UNITTESTS_FAILURES_CAST_H
