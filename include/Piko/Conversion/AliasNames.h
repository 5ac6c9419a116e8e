// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The types of TBAA that the compiler's own code and the runtime's inline code
// have in common: the root, what is the runtime's, and under it what is in a
// writer.

#ifndef PIKO_CONVERSION_ALIASNAMES_H
#define PIKO_CONVERSION_ALIASNAMES_H

namespace piko::aliasNames {

constexpr const char *root = "piko", *runtime = "runtime", *writer = "writer";

} // namespace piko::aliasNames

#endif // PIKO_CONVERSION_ALIASNAMES_H
