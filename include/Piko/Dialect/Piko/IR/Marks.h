// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Discardable attributes, by which passes tell later ones what they know of an
// operation. The dialect refuses all others of its name, and values of another
// kind.

#ifndef PIKO_DIALECT_PIKO_IR_MARKS_H
#define PIKO_DIALECT_PIKO_IR_MARKS_H

#include "llvm/ADT/StringRef.h"

namespace piko::marks {

/// A loop whose iterations lanes may share: over primitives or iterations.
constexpr llvm::StringLiteral lanes = "piko.lanes";
/// A loop over rows of pixels, around one whose iterations lanes may share: all
/// of these pixels may be visited in any order.
constexpr llvm::StringLiteral rows = "piko.rows";
/// A loop that becomes vectors of so many lanes: a 64-bit integer.
constexpr llvm::StringLiteral vectorLanes = "piko.vector_lanes";
/// A mask of the lanes that the last vector of the loop around it has.
constexpr llvm::StringLiteral lastLanes = "piko.last_lanes";
/// A loop over the lanes of a vector that take turns.
constexpr llvm::StringLiteral turns = "piko.turns";
/// A loop around one whose iterations meet at barriers.
constexpr llvm::StringLiteral barriers = "piko.barriers";
/// What lanes are given, a `LaneMappingAttr`, of a loop over primitives.
constexpr llvm::StringLiteral mapping = "piko.mapping";
/// An scf.if between the versions of a loop over primitives; they become
/// functions where the scalar one, its second side, is one of two itself.
constexpr llvm::StringLiteral versions = "piko.versions";
/// How many iterations lanes together are expected to make of a loop that was
/// made of two, one inside of the other: a 64-bit float.
constexpr llvm::StringLiteral iterations = "piko.iterations";
/// An scf.if whose second side a lane may put off for as long as others take
/// the first one, which does nothing for it: in how many turns it runs, a
/// 64-bit float.
constexpr llvm::StringLiteral advances = "piko.advances";
/// How probable it is that an scf.if takes its first side, or that a loop goes
/// on for another iteration, by what the text says with [[likely]] and its
/// like: a 64-bit float from 0 to 1.
constexpr llvm::StringLiteral probability = "piko.probability";
/// How probable each region of an scf.index_switch is, the default one first,
/// by what the text says: an array of 64-bit floats from 0 to 1.
constexpr llvm::StringLiteral probabilities = "piko.probabilities";
/// How threads share the loop over units of work, a `UnitLoopAttr`.
constexpr llvm::StringLiteral units = "piko.units";
/// A loop whose iterations the threads of a block share.
constexpr llvm::StringLiteral shared = "piko.shared";
/// A loop no two iterations of which update one pixel.
constexpr llvm::StringLiteral disjoint = "piko.disjoint";
/// Work, or a bin, on what a local edge takes: what follows takes the same.
constexpr llvm::StringLiteral again = "piko.again";
/// How the threads of a block share work on primitives, or a parallel loop: a
/// `ThreadMappingAttr`.
constexpr llvm::StringLiteral threads = "piko.threads";
/// Of work that threads share by its count: from how many primitives on, a
/// 64-bit integer.
constexpr llvm::StringLiteral fewest = "piko.fewest";
/// How many threads a block of a kernel has: a 64-bit integer.
constexpr llvm::StringLiteral blockSize = "piko.block_size";
/// A loop whose iterations have append buffers of their own.
constexpr llvm::StringLiteral reordered = "piko.reordered";
/// A loop over primitives that the first thread of a block does in order, and
/// emits in.
constexpr llvm::StringLiteral ordered = "piko.ordered";
/// A launch whose work is mapped to the threads of a block.
constexpr llvm::StringLiteral threaded = "piko.threaded";
/// A kernel's second launch, which goes on with the units that the first one
/// has left, and the loop over primitives in it that begins where that was.
constexpr llvm::StringLiteral rest = "piko.rest";
/// A launch that keeps the counters of its units and buckets in shared memory.
constexpr llvm::StringLiteral blockCounters = "piko.block_counters";
/// A launch that keeps its threads' append buffers in shared memory.
constexpr llvm::StringLiteral blockBuffers = "piko.block_buffers";
/// A loop that all threads of a block run alike, which takes what it needs of
/// what is around it from shared memory.
constexpr llvm::StringLiteral blockValues = "piko.block_values";
/// A loop of a kernel that is to be a function of its own: few primitives need
/// it.
constexpr llvm::StringLiteral rare = "piko.rare";
/// A store by which a grid says that the run fails.
constexpr llvm::StringLiteral fails = "piko.fails";
/// A load of a member of the input, where a grid's kernel begins.
constexpr llvm::StringLiteral input = "piko.input";
/// An arith.andi or arith.ori of truth values whose second operand counts only
/// where the first does not decide: a processor may branch.
constexpr llvm::StringLiteral shortCircuit = "piko.short_circuit";
/// An access to an image whose pixel piko-prove-bounds has found to be in the
/// bin.
constexpr llvm::StringLiteral inside = "piko.inside";
/// An array with a number for each pixel of a bin, which primitives change in
/// order of lineage; arrays of one name change together.
constexpr llvm::StringLiteral pixels = "piko.pixels";
/// Of a kernel's function, until it is converted: the number of the stage whose
/// bins it is for, or of the source that it places.
constexpr llvm::StringLiteral number = "piko.number";
/// A kernel's function whose number is that of a source.
constexpr llvm::StringLiteral source = "piko.source";
/// Of the setup of a pipeline whose kernels launch grids: what its program
/// does, an array of `StepAttr`.
constexpr llvm::StringLiteral steps = "piko.steps";

} // namespace piko::marks

#endif // PIKO_DIALECT_PIKO_IR_MARKS_H
