# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""deep-texts.py KIND N: a pipeline whose text nests, or is long, by N."""

import sys

kind, n = sys.argv[1], int(sys.argv[2])
before, body = "", ""
if kind == "templates":
    before = ("template <int N> constexpr int f(int x) {\n"
              "  if constexpr (N == 0) return x; else return f<N - 1>(x);\n}\n")
    body = f"x = f<{n}>(x);"
elif kind == "sum":
    body = "x = " + " + ".join(f"(x ^ {k})" for k in range(n)) + ";"
elif kind == "parentheses":
    body = "x = " + "(" * n + "x" + " + 1)" * n + ";"
elif kind == "elses":
    body = " else ".join(f"if (x == {k}) x = {7 * k};" for k in range(n))
elif kind == "blocks":
    body = "".join(f"if (x > {k}) {{ x -= {k}; " for k in range(n)) + "}" * n
elif kind == "lambdas":
    body = "auto f0 = [&](int v) { return v + 1; };\n" + "".join(
        f"auto f{k} = [&](int v) {{ return f{k - 1}(v) * 3; }};\n"
        for k in range(1, n + 1)) + f"x = f{n}(x);"
elif kind == "members":
    before = "struct M0 { int v; };\n" + "".join(
        f"struct M{k} {{ M{k - 1} m; }};\n" for k in range(1, n + 1))
    body = f"M{n} m{{}};\nm{'.m' * n}.v = x;\nx = m{'.m' * n}.v + 1;"
elif kind == "bases":
    before = "struct B0 { int v; };\n" + "".join(
        f"struct B{k} : B{k - 1} {{}};\n" for k in range(1, n + 1))
    body = f"B{n} b{{}};\nb.v = x;\nx = b.v + 1;"
else:
    sys.exit(f"expected another kind than {kind}")

print(f"""#include <piko.h>
{before}struct State {{ piko::Buffer<int> out; }};
struct A : piko::Stage<0, 0, 64, int>, piko::Uses<State> {{
  void process(const int &i) {{
    int x = i & 63;
    {body}
    state().out[i & 63] = x;
  }}
}};
struct P : piko::Pipe<State> {{ A a; P() {{ source(a); }} }};""")
