// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_MATH_H
#define PIKO_MATH_H
#endif
