// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Qt's `emit` is a macro that expands to nothing: `emit(p)` would compile, as
// an expression without effect.
// RUN: not pikoc %s --emit=authored -o - 2>&1 | FileCheck %s
// RUN: not pikoc %s -DBEFORE --emit=authored -o - 2>&1 | FileCheck %s --check-prefix=BEFORE --implicit-check-not=error:
// RUN: not %cxx_reference -DBEFORE -fsyntax-only %s 2>&1 | FileCheck %s --check-prefix=BEFORE --implicit-check-not=error:
// RUN: pikoc %s -DAFTER --emit=authored -o - 2>&1 | FileCheck %s --check-prefix=AFTER
#ifdef BEFORE
#define emit
#endif
// BEFORE: piko.h:{{.*}}error: {{.*}}a macro called 'emit' hides a function of Piko: with Qt, define QT_NO_KEYWORDS; else write '#undef emit' before this header
#include <piko.h>
#ifndef BEFORE
// CHECK: :[[#@LINE+2]]:9: error: a macro called 'emit' hides a function of the language
// CHECK: note: with Qt, define QT_NO_KEYWORDS; else write '#undef emit' before the pipeline
#define emit
// CHECK: :[[#@LINE+2]]:9: error: a macro called 'source' hides a function of the language
// CHECK: note: write '#undef source' before the pipeline
#define source(x)
// Of names that are no functions, and of what nothing calls.
#define slots
#define log(...)
#endif
#ifdef AFTER
#undef emit
#undef source
#endif

struct Copy : piko::Stage<0, 0, 1, int, int> {
  // AFTER: piko.emit
  void process(const int &p) { emit(p); }
};
struct End : piko::Stage<0, 0, 1, int> {
  void process(const int &) {}
};
struct Pipeline : piko::Pipe<> {
  Copy copy;
  End end;
  Pipeline() {
    source(copy);
    connect(copy, 0, end);
  }
};
