// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What operations take on a processor, as lanes and one after the other:
// measured, and the only numbers of the cost model that depend on it.

#ifndef PIKO_LIB_TRANSFORMS_LANECYCLES_H
#define PIKO_LIB_TRANSFORMS_LANECYCLES_H

#include "llvm/ADT/ArrayRef.h"

#include <cstdint>

namespace piko {

/// What the operations of as many iterations as there are lanes take, in
/// cycles.
struct Cycles {
  double scalar, scalarAccess, scalarDivision;
  double vector, row, gather, division;
  /// A row of numbers below 32 bits, whose lanes may have no masks.
  double narrowRow;
  /// A row that is changed in a private copy, which notes that it was.
  double reducedRow;
  /// A quotient of integers by way of floats, and one of a divisor that all
  /// lanes share.
  double quotient, sharedQuotient;
  /// A gather of numbers below 32 bits, for which there is no instruction; and
  /// what it takes more if each lane goes through memory on its own.
  double narrowGather, ownLines;
  /// One of several words of an element that are read at once.
  double transposed;
  /// A word of a record that is emitted, and one that is appended to a list.
  double emitted, compressed;
  /// A scatter, and of numbers below 32 bits; and what each row takes of a
  /// short array that is read, or written, at places that differ.
  double scatter, narrowScatter, readRow, writeRow;
  /// How many times as fast LLVM makes a loop that it runs as vectors.
  double along;
  /// To bring lanes apart, for one operation or for a group, and to hand each
  /// lane a number.
  double apart, apartInOrder, slot;
  /// Branches of a condition that differs: to what fails, around what takes
  /// iterations, and others, which are not foreseen; and of a loop whose
  /// iterations differ.
  double checks, branches, unforeseen, exits;
  /// What iterations wait, one after the other, for a load whose place another
  /// load has said: for the second level of the cache, and to have the place
  /// back from where it was kept.
  double chase;
  /// What each iteration of such a loop takes to find who goes on.
  double iteration;
  /// To find which lane makes which iteration, and to bring there what it has.
  double pairs;
  /// How many of the lanes go on, of those that came to a loop whose iterations
  /// differ; and to one inside of such a loop.
  double goOn, goOnInside;
  /// How many of the lanes have a pixel of a box's row: most boxes are those of
  /// small primitives.
  double boxRow;
};

/// With vectors of 512 bits (Sapphire Rapids, Zen 4), of 256 bits, and of 128
/// bits without masks: a branch for each lane stands for one.
const Cycles &getCycles(int64_t laneCount);

/// All of the numbers, by name, for whoever fits them to measurements
/// (benchmarks/mappings.py).
struct CycleConstant {
  const char *name;
  double Cycles::*member;
};
llvm::ArrayRef<CycleConstant> getCycleConstants();

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_LANECYCLES_H
