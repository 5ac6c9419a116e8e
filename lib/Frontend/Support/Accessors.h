//===- Accessors.h - Functions that stand for memory's uses ------*- C++
//-*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the clean-up leaves where LLVM IR had loads, stores and divisions, and
// the import turns into operations.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_SUPPORT_ACCESSORS_H
#define PIKO_LIB_FRONTEND_SUPPORT_ACCESSORS_H

#include "llvm/ADT/StringRef.h"

#include <optional>

namespace piko {

/// Accessors: functions without a body that the steps leave in the IR.
namespace accessor {
constexpr llvm::StringLiteral emit = "piko.emit";
constexpr llvm::StringLiteral clear = "piko.clear";
constexpr llvm::StringLiteral updateBegin = "piko.update_begin";
constexpr llvm::StringLiteral updateEnd = "piko.update_end";
constexpr llvm::StringLiteral reduceBegin = "piko.reduce_begin";
constexpr llvm::StringLiteral scanBegin = "piko.scan_begin";
constexpr llvm::StringLiteral combineEnd = "piko.combine_end";
/// A number that one of the above gives.
constexpr llvm::StringLiteral given = "piko.given.";
constexpr llvm::StringLiteral load = "piko.load.";
constexpr llvm::StringLiteral store = "piko.store.";
constexpr llvm::StringLiteral atomic = "piko.atomic.";
constexpr llvm::StringLiteral atomicFetch = "piko.atomic_fetch.";
/// What follows shows the order of primitives: whether an atomic's result does.
constexpr llvm::StringLiteral showsOrder = "piko.shows_order";
constexpr llvm::StringLiteral share = "piko.share";
/// An integer division; which one and of which type follows.
constexpr llvm::StringLiteral divide = "piko.divide.";
/// Around an update, with the address of its pixel.
constexpr llvm::StringLiteral pixelBegin = "piko.pixel_begin";
constexpr llvm::StringLiteral pixelEnd = "piko.pixel_end";
} // namespace accessor

/// The opcode of the division that a call of this function is.
std::optional<unsigned> getDivision(llvm::StringRef callee);

/// What no index and no tag can say where it points, and what to write instead.
constexpr llvm::StringLiteral manyPlaces =
    "a pointer that can point to different places; use an index, or a branch "
    "for each place";

} // namespace piko

#endif // PIKO_LIB_FRONTEND_SUPPORT_ACCESSORS_H
