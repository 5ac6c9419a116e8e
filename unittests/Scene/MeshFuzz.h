//===- MeshFuzz.h - Mutated files for the readers of meshes -----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_UNITTESTS_SCENE_MESHFUZZ_H
#define PIKO_UNITTESTS_SCENE_MESHFUZZ_H

#include <cstdint>
#include <string>

/// Reads `count` files, each made of one of a small corpus by a few mutations
/// that follow from `seed`. \returns what is wrong with the meshes that came of
/// them, "" if nothing is
std::string fuzzReaders(uint64_t seed, uint64_t count);

#endif // PIKO_UNITTESTS_SCENE_MESHFUZZ_H
