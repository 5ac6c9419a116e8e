# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Writes a pipeline whose author has a function for every word of piko.h.

  names.py FOLDER-OF-PIKO.H LANGUAGE.md members|namespace

Every identifier of Piko's headers, but for the names of the language, is the
name of one of the pipeline's own functions. `members` calls them in phases and
in the constructor of a pipeline, where a member of a base would hide them;
`namespace` calls them after `using namespace piko`. Names of the language that
its description does not have are an error.
"""
import pathlib
import re
import sys

STAGE = """
    assignBin assignToAll assignToBin assignToBoundingBox assignToLine
    assignToPreviousBins
    schedule specifySchedule endStage endBin batch everyBin specifyOrder
    specifyLanes specifyPrecision specifyUlps specifyName process emit update
    parallelFor parallelForPixels sync any all count reduce
    scan sort bin binLo binHi binFromPosition domain state BasicStage Stage
    Uses"""
PIPE = """
    source connect allocateForSource expectIndex state setDomain feed run tryRun
    setLoopLimit setThreads setMemoryLimit setMemoryBudget setStripSize
    setMappings expectNumbers nameState Pipe"""
NAMESPACE = """
    All BasicStage BinId Bins Buffer Cells DirectMap Error Image InLineage Lanes List
    LoadBalance NoState Order Pipe Position Precision SchedulePolicy Serialize Stage
    Status Unordered Uses acos asin atan atan2 atomicAdd atomicAddFetch atomicAnd
    atomicMax atomicMin atomicOr atomicXor cbrt cos cosh exp exp2 fma hypot log
    log10 log2 max min pow rsqrt sin sinh sqrt tan tanh toInt toInt64 toUint tunable"""
# Of namespaces, which are no names for functions; piko.h needs the others.
SPACES = "piko std glm user detail marker reference within"
# What other headers declare globally as no function.
OTHERS = """
    FPE_INTDIV FP_CONTRACT INT32_MAX INT32_MIN INT64_MAX INT64_MIN UINT32_MAX
    MADV_NOHUGEPAGE MAP_ANONYMOUS MAP_FAILED MAP_NORESERVE MAP_PRIVATE MAP_STACK
    PROT_READ PROT_WRITE SA_NODEFER SA_SIGINFO SIGFPE SIG_UNBLOCK sa_sigaction
    sigaction siginfo_t sigjmp_buf sigsetjmp ucontext_t va_list FE_DFL_ENV"""
KEYWORDS = """
    __PIKO__ alignas alignof and auto bool break case catch char class concept const
    consteval constexpr const_cast continue decltype default define defined
    delete do double else endif enum error explicit extern false final float for
    friend goto if ifdef ifndef include inline int long mutable namespace
    new noexcept not nullptr operator or override pragma private protected
    public register reinterpret_cast requires return short signed sizeof static
    static_assert static_cast struct switch template this thread_local throw
    true try typedef typename undef union unsigned using virtual void volatile
    while xor elif once"""


def words(text):
    return set(text.split())


def identifiers(folder):
    found = set()
    for header in sorted(folder.rglob("piko*")):
        if header.suffix == ".h" and "pikort" not in header.parts:
            found |= set(re.findall(r"[A-Za-z_]\w*", header.read_text()))
    for header in sorted((folder / "piko").rglob("*.[hd]*")):
        found |= set(re.findall(r"[A-Za-z_]\w*", header.read_text()))
    return found


def main():
    folder, language, kind = sys.argv[1:]
    documented = set(
        re.findall(r"[A-Za-z_]\w*", pathlib.Path(language).read_text()))
    names = identifiers(pathlib.Path(folder))
    names -= words(KEYWORDS) | words(SPACES) | words(OTHERS)
    names = {name for name in names
             if "__" not in name and not name.startswith(("PIKO", "_"))
             and not (kind == "namespace" and name.endswith("_t"))}
    language_names = words(STAGE + PIPE)
    if kind == "namespace":
        language_names |= words(NAMESPACE)
    missing = language_names - documented
    if missing:
        sys.exit(f"expected a description of {sorted(missing)}")
    names = sorted(names - language_names)
    if len(names) < 300:
        sys.exit(f"expected many names, but got {len(names)}")

    print("#include <piko.h>")
    print("namespace user {" if kind == "members" else "using namespace piko;")
    print("struct Probe { int n; };")
    for name in names:
        print(f"inline int {name}(Probe p) {{ return p.n; }}")
    calls = " + ".join(f"{name}(probe)" for name in names)
    print(f"""
struct MyState {{ ::piko::Buffer<int> my_numbers; }};
struct MyStage : ::piko::Stage<4, 4, 8, int, int>, ::piko::Uses<MyState> {{
  void assignBin(const int &my) {{
    Probe probe{{my}};
    assignToBin(my, {{({calls}) * 0}});
  }}
  void process(const int &my) {{
    Probe probe{{my}};
    emit({calls});
  }}
}};
struct MyEnd : ::piko::Stage<0, 0, 1, int>, ::piko::Uses<MyState> {{
  void schedule(::piko::BinId my) {{
    Probe probe{{int(my.index)}};
    specifySchedule(::piko::All, ({calls}) * 0 + 1);
  }}
  void process(const int &my) {{ ::piko::atomicAdd(state().my_numbers[0], my); }}
}};
struct MyPipe : ::piko::Pipe<MyState> {{
  MyStage my_stage;
  MyEnd my_end;
  MyPipe() {{
    Probe probe{{0}};
    source(my_stage);
    connect(my_stage, ({calls}) * 0, my_end);
  }}
}};""")
    if kind == "members":
        print("} // namespace user")


main()
