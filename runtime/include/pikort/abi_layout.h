// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- abi_layout.h - Where generated code finds members ------------------===//
//
// The compiler knows the structs of abi.h by these numbers. One that changes is
// another version of the ABI.
//
//===----------------------------------------------------------------------===//

#ifndef PIKORT_ABI_LAYOUT_H
#define PIKORT_ABI_LAYOUT_H

#include "pikort/abi.h"

#include <stddef.h>

#ifdef __cplusplus
#define PIKOIR_ASSERT(condition, text) static_assert(condition, text)
#else
#define PIKOIR_ASSERT(condition, text) _Static_assert(condition, text)
#endif
#define PIKOIR_ASSERT_SIZE(type, bytes)                                        \
  PIKOIR_ASSERT(sizeof(type) == (bytes), #type " changed")
#define PIKOIR_ASSERT_OFFSET(type, member, bytes)                              \
  PIKOIR_ASSERT(offsetof(type, member) == (bytes), #type "." #member " moved")

PIKOIR_ASSERT(sizeof(void *) == 8, "the runtime needs 64-bit pointers");
PIKOIR_ASSERT_SIZE(pikort_program, 32);
PIKOIR_ASSERT_OFFSET(pikort_program, abi_version, 0);
PIKOIR_ASSERT_OFFSET(pikort_program, name, 8);
PIKOIR_ASSERT_OFFSET(pikort_program, setup, 16);
PIKOIR_ASSERT_OFFSET(pikort_program, run, 24);
PIKOIR_ASSERT_SIZE(pikoir_state, 40);
PIKOIR_ASSERT_OFFSET(pikoir_state, data, 0);
PIKOIR_ASSERT_OFFSET(pikoir_state, extent, 8);
PIKOIR_ASSERT_SIZE(pikoir_tile, 16);
PIKOIR_ASSERT_OFFSET(pikoir_tile, data, 0);
PIKOIR_ASSERT_OFFSET(pikoir_tile, pitch, 8);
PIKOIR_ASSERT_SIZE(pikoir_unit, 40);
PIKOIR_ASSERT_OFFSET(pikoir_unit, bucket_begin, 0);
PIKOIR_ASSERT_OFFSET(pikoir_unit, bucket_end, 8);
PIKOIR_ASSERT_OFFSET(pikoir_unit, begin, 16);
PIKOIR_ASSERT_OFFSET(pikoir_unit, end, 24);
PIKOIR_ASSERT_OFFSET(pikoir_unit, owner, 32);
PIKOIR_ASSERT_SIZE(pikoir_call, 24);
PIKOIR_ASSERT_OFFSET(pikoir_call, bin, 0);
PIKOIR_ASSERT_OFFSET(pikoir_call, begin, 8);
PIKOIR_ASSERT_OFFSET(pikoir_call, end, 16);
PIKOIR_ASSERT_SIZE(pikoir_cursor, 64);
PIKOIR_ASSERT_OFFSET(pikoir_cursor, next, 0);
PIKOIR_ASSERT_OFFSET(pikoir_cursor, end, 8);
PIKOIR_ASSERT_SIZE(pikoir_input, 96);
PIKOIR_ASSERT_OFFSET(pikoir_input, items, 0);
PIKOIR_ASSERT_OFFSET(pikoir_input, count, 8);
PIKOIR_ASSERT_OFFSET(pikoir_input, order, 16);
PIKOIR_ASSERT_OFFSET(pikoir_input, offsets, 24);
PIKOIR_ASSERT_OFFSET(pikoir_input, units, 32);
PIKOIR_ASSERT_OFFSET(pikoir_input, unit_count, 40);
PIKOIR_ASSERT_OFFSET(pikoir_input, tiles, 48);
PIKOIR_ASSERT_OFFSET(pikoir_input, calls, 56);
PIKOIR_ASSERT_OFFSET(pikoir_input, call_count, 64);
PIKOIR_ASSERT_OFFSET(pikoir_input, clears, 72);
PIKOIR_ASSERT_OFFSET(pikoir_input, cursors, 80);
PIKOIR_ASSERT_OFFSET(pikoir_input, homes, 88);
PIKOIR_ASSERT_SIZE(pikoir_port, 120);
PIKOIR_ASSERT_OFFSET(pikoir_port, cursor, 0);
PIKOIR_ASSERT_OFFSET(pikoir_port, limit, 8);
PIKOIR_ASSERT_OFFSET(pikoir_port, size, 16);
PIKOIR_ASSERT_OFFSET(pikoir_port, emitted, 24);
PIKOIR_ASSERT_OFFSET(pikoir_port, kept, 32);
PIKOIR_ASSERT_OFFSET(pikoir_port, bucket_cursor, 40);
PIKOIR_ASSERT_OFFSET(pikoir_port, bucket_end, 48);
PIKOIR_ASSERT_OFFSET(pikoir_port, last_bucket, 56);
PIKOIR_ASSERT_OFFSET(pikoir_port, buckets, 64);
PIKOIR_ASSERT_OFFSET(pikoir_port, run, 96);
PIKOIR_ASSERT_OFFSET(pikoir_port, flags, 116);
PIKOIR_ASSERT_SIZE(pikoir_writer, 40);
PIKOIR_ASSERT_OFFSET(pikoir_writer, unit, 0);
PIKOIR_ASSERT_OFFSET(pikoir_writer, ordinal, 8);
PIKOIR_ASSERT_OFFSET(pikoir_writer, flags, 12);
PIKOIR_ASSERT_OFFSET(pikoir_writer, port_count, 16);
PIKOIR_ASSERT_OFFSET(pikoir_writer, stage, 20);
PIKOIR_ASSERT_OFFSET(pikoir_writer, ports, 24);
PIKOIR_ASSERT_OFFSET(pikoir_writer, mappings, 32);

PIKOIR_ASSERT_SIZE(pikoir_private, 16);
PIKOIR_ASSERT_OFFSET(pikoir_private, data, 0);
PIKOIR_ASSERT_OFFSET(pikoir_private, dirty, 8);

#undef PIKOIR_ASSERT_OFFSET
#undef PIKOIR_ASSERT_SIZE
#undef PIKOIR_ASSERT

#endif // PIKORT_ABI_LAYOUT_H
