// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Expectations of tests in C; each prints where it fails.

#ifndef PIKO_UNITTESTS_CAPI_CHECK_H
#define PIKO_UNITTESTS_CAPI_CHECK_H

#include <stdio.h>
#include <string.h>

static int failures = 0;

#define EXPECT(condition)                                                      \
  ((condition) ? (void)0                                                       \
               : (void)(++failures, fprintf(stderr, "%s:%d: expected %s\n",    \
                                            __FILE__, __LINE__, #condition)))

/// A text with a part; says which text it was.
#define EXPECT_HAS(text, part)                                                 \
  (strstr(text, part)                                                          \
       ? (void)0                                                               \
       : (void)(++failures, fprintf(stderr, "%s:%d: expected '%s' in '%s'\n",  \
                                    __FILE__, __LINE__, part, text)))

#define EXPECT_STATUS(status, call)                                            \
  do {                                                                         \
    int got = (call);                                                          \
    if (got != (status)) {                                                     \
      ++failures;                                                              \
      fprintf(stderr, "%s:%d: expected %s of %s, but got %d\n", __FILE__,      \
              __LINE__, #status, #call, got);                                  \
    }                                                                          \
  } while (0)

#endif // PIKO_UNITTESTS_CAPI_CHECK_H
