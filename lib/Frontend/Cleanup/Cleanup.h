//===- Cleanup.h - Removing C++ from a pipeline's LLVM IR -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The steps, in order, each a file:
//
//   1. checkCalls      what a phase cannot call is an error
//      (first expandComparisons: those that the standard library calls)
//   2. always-inline   the wrappers become one function each
//   3. expandMarkers   markers take and give numbers, not pointers to records
//      labelLoops      what belongs to the iterations of a parallelFor
//      holdDivisions   what an integer division without a result is, the run
//      says
//      unrollComponents  loops over the components of a vector
//   4. rounds of       splitMemory     copies and variables, number by number
//                      expandCopies    copies that are loops
//                      flattenPointers phis and selects of pointers (first
//                                      indexPointers: those that walk)
//                      expandLocalAtomics
//                      releasePixels   no reference to a pixel is kept
//                      promoteVariables, early-cse, simplifycfg
//   5. shareArrays, SROA
//   6. resolveAccesses loads and stores outside of local memory become calls
//                      of accessors, which name the field
//   7. early-cse, simplifycfg, instcombine, dce
//
// What is left: numbers, branches, local arrays of numbers, and calls of
// markers and accessors.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_CLEANUP_CLEANUP_H
#define PIKO_LIB_FRONTEND_CLEANUP_CLEANUP_H

#include "Parse/Parse.h"
#include "Support/Memory.h"

namespace piko {

/// Does all of the above; false after an error.
bool cleanUp(ParsedUnit &unit, MemoryMap &memory, mlir::MLIRContext &context);

/// Comparisons of arrays whose elements are known become loops.
void expandComparisons(llvm::Module &module);

/// Marks all that the functions call to be inlined; false after an error.
bool checkCalls(llvm::ArrayRef<llvm::Function *> functions, ParsedUnit &unit,
                mlir::MLIRContext &context);

/// Edges and sources stay where the pipeline's wiring is read.
void expandMarkers(llvm::Function &function, MemoryMap &memory, bool isWiring);

/// Unrolls the innermost loops over the components of a vector; whether there
/// were any.
bool unrollComponents(llvm::Function &function);

/// Both return whether they changed anything.
bool splitMemory(llvm::Function &function, MemoryMap &memory);
bool flattenPointers(llvm::Function &function, MemoryMap &memory);

/// Copies and fills of a number of elements that varies become loops; whether
/// there were any.
bool expandCopies(llvm::Function &function, const ParsedUnit &unit,
                  MemoryMap &memory);
/// A number each byte of which is this one.
llvm::Value *repeatByte(llvm::IRBuilderBase &builder, llvm::Value *byte,
                        llvm::Type *type, const llvm::DataLayout &data);

/// Atomics on local variables become loads and stores; false after an error.
bool expandLocalAtomics(llvm::Function &function, const ParsedUnit &unit,
                        MemoryMap &memory, mlir::MLIRContext &context,
                        bool &changed);

/// Refuses what is done with an update's pixel after the update, and no longer
/// keeps in memory those of which all is known, or `all`; false after an error.
bool releasePixels(llvm::Function &function, const ParsedUnit &unit,
                   MemoryMap &memory, mlir::MLIRContext &context, bool all,
                   bool &changed);

/// Makes calls of integer divisions.
void holdDivisions(llvm::Function &function);
/// Makes divisions again of those calls that are known to have a result;
/// whether there were any.
bool releaseDivisions(llvm::Function &function);

/// Constant tables that are indexed become local arrays.
bool localizeTables(llvm::Function &function, MemoryMap &memory);

/// False after an error.
bool resolveAccesses(llvm::Function &function, ParsedUnit &unit,
                     MemoryMap &memory, mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_CLEANUP_CLEANUP_H
