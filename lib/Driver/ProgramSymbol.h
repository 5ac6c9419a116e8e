// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What an object calls the program of a pipeline. No header of LLVM is needed
// here.

#ifndef PIKO_LIB_DRIVER_PROGRAMSYMBOL_H
#define PIKO_LIB_DRIVER_PROGRAMSYMBOL_H

#include <string>
#include <string_view>

namespace piko {

/// The symbol, a pikort_program, of a pipeline by its name.
std::string getProgramSymbol(std::string_view nameSpace,
                             std::string_view pipeline);

} // namespace piko

#endif // PIKO_LIB_DRIVER_PROGRAMSYMBOL_H
