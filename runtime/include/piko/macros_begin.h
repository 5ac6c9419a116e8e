//===- piko/macros_begin.h - Puts macros of the host's aside --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// X11 has macros `None` and `Status`, and Windows has `min` and `max`. From
// here to piko/macros_end.h they are names as others are. Pairs nest.
//
//===----------------------------------------------------------------------===//
#pragma push_macro("None")
#undef None
#pragma push_macro("Status")
#undef Status
#pragma push_macro("max")
#undef max
#pragma push_macro("min")
#undef min
