// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Parser.h - Parts of the parser of PTX ------------------------------===//

#ifndef PIKO_TEST_DRIVER_PTX_PARSER_H
#define PIKO_TEST_DRIVER_PTX_PARSER_H

#include "ptx/text/Lexer.h"
#include "ptx/text/Syntax.h"

namespace piko::ptx {

/// A variable from after its state space to its initialiser, or a parameter.
/// The mark after it is not taken.
Variable parseVariable(Lexer &lexer, Space space);

/// Takes all tokens of a line, such as those of .loc.
void skipLine(Lexer &lexer);

/// Takes the body of a function, from its { to its }.
void parseBody(Lexer &lexer, FunctionSyntax &function);

} // namespace piko::ptx

#endif // PIKO_TEST_DRIVER_PTX_PARSER_H
