/* SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
 *
 * What emissions do nearly always, without a call of the runtime: the fast path
 * of functions of pikort/abi.h, which generated code has inline. The compiler
 * has this file as bitcode (runtime/inline/Emission.cpp), and links and inlines
 * what a program uses.
 */
#ifndef PIKORT_EMISSION_H
#define PIKORT_EMISSION_H

#include "pikort/abi.h"

#ifndef PIKORT_INLINE
#define PIKORT_INLINE static inline
#endif

#ifdef __cplusplus
extern "C" {
#endif

PIKORT_INLINE uint8_t *pikoir_append_inline(pikoir_writer *writer,
                                            int32_t port) {
  pikoir_port *out = &writer->ports[port];
  uint8_t *record = out->cursor;
  // One branch of a condition that hardly ever holds.
  if ((record > out->limit) |
      ((out->flags & ~(PIKOIR_PORT_LOCAL | PIKOIR_PORT_COUNTS)) != 0))
    return pikoir_append(writer, port);
  ++out->emitted;
  if (out->buckets != 0) // kept by its first place
    out->last_bucket = -1;
  else
    out->cursor = record + out->size;
  return record;
}

PIKORT_INLINE void pikoir_place_inline(pikoir_writer *writer, int32_t port,
                                       int64_t bucket) {
  pikoir_port *out = &writer->ports[port];
  int64_t last = out->last_bucket;
  uint32_t *place = out->bucket_cursor;
  if ((bucket <= last) | (bucket >= out->buckets) | (place == out->bucket_end) |
      ((out->flags & ~(PIKOIR_PORT_COUNTS | PIKOIR_PORT_SOURCE)) != 0)) {
    pikoir_place(writer, port, bucket);
    return;
  }
  uint32_t entry = (uint32_t)bucket;
  if (last < 0) {
    entry |= PIKOIR_FIRST_BUCKET;
    out->cursor += out->size;
    out->run = place;
    ++out->kept;
  }
  *place = entry;
  out->bucket_cursor = place + 1;
  out->last_bucket = bucket;
}

/// pikoir_place for a port whose edge is local.
PIKORT_INLINE void pikoir_place_local_inline(pikoir_writer *writer,
                                             int32_t port, int64_t bucket) {
  pikoir_port *out = &writer->ports[port];
  if (((uint64_t)bucket >= (uint64_t)out->buckets) | (out->last_bucket != -1) |
      ((out->flags & ~PIKOIR_PORT_LOCAL) != 0)) {
    pikoir_place(writer, port, bucket);
    return;
  }
  out->cursor += out->size;
  out->last_bucket = bucket;
}

/// Whether pikoir_next has anything to do.
PIKORT_INLINE int32_t pikoir_is_counted_inline(const pikoir_writer *writer) {
  return writer->flags;
}

PIKORT_INLINE void pikoir_next_inline(pikoir_writer *writer) {
  if (writer->flags != 0)
    pikoir_next(writer);
}

/// pikoir_next of a source's AssignBin.
PIKORT_INLINE void pikoir_next_source_inline(pikoir_writer *writer) {
  pikoir_port *out = &writer->ports[0];
  if (out->last_bucket < 0)
    pikoir_next(writer);
  else
    out->last_bucket = -1;
}

/// Whether a unit runs a loop of its kernel as vectors, by its number.
PIKORT_INLINE int32_t pikoir_takes_vectors_inline(const pikoir_writer *writer,
                                                  int64_t number) {
  return (writer->mappings >> number & 1) != 0;
}

// --- lanes that emit at once -------------------------------------------------

/// Where so many records of a port may be written.
PIKORT_INLINE uint8_t *pikoir_reserve_inline(pikoir_writer *writer,
                                             int32_t port, int64_t count) {
  pikoir_port *out = &writer->ports[port];
  if (out->cursor + out->size * (count - 1) > out->limit)
    pikoir_reserve(writer, port, count);
  return out->cursor;
}

/// pikoir_append for records that were written there one after the other.
/// Records that are put nowhere are not kept.
PIKORT_INLINE void pikoir_append_lanes_inline(pikoir_writer *writer,
                                              int32_t port, int64_t count) {
  pikoir_port *out = &writer->ports[port];
  out->emitted += count;
  out->cursor += (out->buckets == 0 ? count : 0) * out->size;
}

/// How many buckets a port's edge has.
PIKORT_INLINE int64_t pikoir_buckets_inline(const pikoir_writer *writer,
                                            int32_t port) {
  return writer->ports[port].buckets;
}

/// Whether each of the lanes' records has to be put into its bucket apart: the
/// port has flags, or no room for so many entries.
PIKORT_INLINE int32_t pikoir_places_apart_inline(const pikoir_writer *writer,
                                                 int32_t port,
                                                 int64_t entries) {
  const pikoir_port *out = &writer->ports[port];
  return (out->bucket_cursor + entries > out->bucket_end) | (out->flags != 0);
}

/// The same where the port's edge is local.
PIKORT_INLINE int32_t
pikoir_places_apart_local_inline(const pikoir_writer *writer, int32_t port) {
  return (writer->ports[port].flags & ~PIKOIR_PORT_LOCAL) != 0;
}

/// One of them.
PIKORT_INLINE void pikoir_place_apart_inline(pikoir_writer *writer,
                                             int32_t port, int64_t bucket) {
  pikoir_port *out = &writer->ports[port];
  ++out->emitted;
  out->last_bucket = -1;
  pikoir_place(writer, port, bucket);
}

/// All of them, whose edge is local.
PIKORT_INLINE void pikoir_place_lanes_local_inline(pikoir_writer *writer,
                                                   int32_t port,
                                                   int64_t count) {
  pikoir_port *out = &writer->ports[port];
  out->emitted += count;
  out->cursor += count * out->size;
}

/// All of them: where the entry of each is to be written, with
/// PIKOIR_FIRST_BUCKET. pikoir_end_buckets_inline then gets the end.
PIKORT_INLINE uint32_t *pikoir_place_lanes_inline(pikoir_writer *writer,
                                                  int32_t port, int64_t count) {
  pikoir_port *out = &writer->ports[port];
  pikoir_place_lanes_local_inline(writer, port, count);
  out->kept += count;
  return out->bucket_cursor;
}
PIKORT_INLINE void pikoir_end_buckets_inline(pikoir_writer *writer,
                                             int32_t port, uint32_t *end) {
  writer->ports[port].bucket_cursor = end;
}

#ifdef __cplusplus
} // extern "C"
#endif

#endif // PIKORT_EMISSION_H
