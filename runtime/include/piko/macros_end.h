//===- piko/macros_end.h - Gives the host its macros back -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#pragma pop_macro("None")
#pragma pop_macro("Status")
#pragma pop_macro("max")
#pragma pop_macro("min")
