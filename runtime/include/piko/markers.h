//===- piko/markers.h - What the compiler recognises ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Under __PIKO__ the language is written in terms of these functions. None has
// a body: the front end finds their calls in the LLVM IR of a pipeline and
// turns them into operations of the piko dialect. They are found by their
// declarations, so that names and template arguments, not mangled text, say
// what a call means (lib/Frontend/Support/Markers.cpp lists them all).
//
// A marker that takes or returns a pointer to a record is a template over the
// record's type, whose layout the front end knows from Clang.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_MARKERS_H
#define PIKO_MARKERS_H

#include <stdint.h>

namespace piko::marker {

// Memory that is not the function's own. `handle` is the address of the
// Buffer or Image in the state.
template <class S> S *state();
template <class T> const T *input();
template <class T>
T *element(const void *handle, int64_t x, int64_t y, int64_t z, int64_t w);
int64_t listSize();
template <class T> const T *listAt(int64_t i);
int64_t extent(const void *handle, int32_t dim);
int32_t imageExtent(const void *handle, int32_t dim);

// Effects.
template <class T> void emit(int32_t port, const T *record);
template <class T>
void updateBegin(T *pixel, const void *handle, int64_t x, int64_t y, int64_t z,
                 int64_t w);
template <class T> void updateEnd(const T *pixel);
template <int Kind, bool Signed, class T> void atomic(T *place, T value);
template <int Kind, bool Signed, class T> T atomicFetch(T *place, T value);

// for (i = loopFirst(); loopMore(i, n, 0); i = loopNext(i)): iterations that do
// not depend on one another. The front end numbers the loops.
int32_t loopFirst();
bool loopMore(int32_t i, int64_t n, int32_t loop);
int32_t loopNext(int32_t i);
// As n: the cells from the first four up to, and not including, the last four;
// and in an iteration then, a coordinate of its cell.
int64_t cellsOf(int32_t x0, int32_t y0, int32_t z0, int32_t w0, int32_t x1,
                int32_t y1, int32_t z1, int32_t w1);
int32_t cellAt(int32_t i, int32_t dim);
void sync();

// In the place of a sync. What is between the beginning and the end combines
// two values, a and b.
template <class T> void reduceBegin(T *a, T *b, const T *value);
template <class T> void scanBegin(T *a, T *b, const T *value, const T *empty);
template <class T> void combineEnd(const T *combined, T *result);
template <bool Signed, class K> int64_t sort(K key);

// The grid of bins.
int64_t bin();
// Positions are floats, for which a domain must not be too large.
void floatPosition();
int64_t binAt(int64_t x, int64_t y, int64_t z, int64_t w);
int32_t binLo(int64_t bin, int32_t dim);
int32_t binHi(int64_t bin, int32_t dim);
int32_t domain(int32_t dim);

// AssignBin.
void assignBin(int64_t bin);
/// The bin of positions of NaN, an error (PIKOIR_NAN_BOX).
constexpr int64_t nanPosition = -(int64_t(1) << 40);
void assignAll();
void assignPrevious();
void assignBox(int64_t x0, int64_t y0, int64_t z0, int64_t w0, int64_t x1,
               int64_t y1, int64_t z1, int64_t w1);
void assignLine(int64_t x0, int64_t y0, int64_t z0, int64_t w0, int64_t x1,
                int64_t y1, int64_t z1, int64_t w1);
/// All of them: the operation that each becomes, and what both take. Of four
/// coordinates a point has as many as the pipeline has dimensions.
struct Assignment {
  const char *marker, *operation;
  enum Operands { Nothing, Bin, TwoPoints } operands;
};
inline constexpr Assignment assignments[] = {
    {"assignBin", "piko.assign_to", Assignment::Bin},
    {"assignAll", "piko.assign_all", Assignment::Nothing},
    {"assignPrevious", "piko.assign_previous", Assignment::Nothing},
    {"assignBox", "piko.assign_box", Assignment::TwoPoints},
    {"assignLine", "piko.assign_line", Assignment::TwoPoints},
};

// Schedule.
void schedule(int32_t policy, int64_t tileSplit);
template <class S> void endStage();
void endBin();
void batch(int64_t size);
void everyBin();
void order(int32_t order);
void lanes(int32_t lanes);
void precision(int32_t precision);

// The graph. Stages are given by their addresses in the pipeline.
void source(const void *stage);
void connect(const void *producer, int32_t port, const void *consumer);
void allocateForSource(const void *handle, int64_t source);

// Between the construction of the pipeline object and the call of a phase.
void phase();

// What an image is cleared to.
template <class T> void clear(const T *value);

} // namespace piko::marker

#endif // PIKO_MARKERS_H
