// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// scale-bins: makes the bins of all stages larger.

#ifndef SCALEBINS_H
#define SCALEBINS_H

/// Registers the pass for command lines.
void registerScaleBins();

#endif // SCALEBINS_H
