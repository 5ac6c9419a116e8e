//===- CallChecker.cpp - What a phase may call ----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Headers are full of what Piko does not have. Only what a phase really calls
// is judged: from the wrappers on, each function that is called is visited and
// marked to be inlined.
//
//===----------------------------------------------------------------------===//

#include "Cleanup/Cleanup.h"
#include "Import/MathCalls.h"
#include "Support/CallChain.h"
#include "llvm/ADT/StringMap.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/Instructions.h"
#include "llvm/Support/SaveAndRestore.h"

using namespace piko;
using llvm::dyn_cast;

/// The part of C++ that a function of its runtime library stands for; empty for
/// another function.
static llvm::StringRef getLanguageFeature(llvm::StringRef name) {
  static constexpr llvm::StringLiteral allocation[] = {
      "operator new", "operator new[]", "operator delete", "operator delete[]",
      "malloc",       "free",           "calloc",          "realloc",
      "aligned_alloc"};
  if (llvm::is_contained(allocation, name))
    return "dynamic allocation";
  if (name == "__dynamic_cast" || name == "__cxa_bad_typeid" ||
      name == "__cxa_bad_cast" || name.starts_with("std::type_info"))
    return "run-time type information";
  static constexpr llvm::StringLiteral exceptions[] = {
      "__cxa_allocate_exception", "__cxa_throw", "__cxa_rethrow",
      "__cxa_throw_bad_array_new_length"};
  if (llvm::is_contained(exceptions, name) || name.starts_with("std::__throw_"))
    return "exceptions";
  return "";
}

/// What to write instead of a function of a library.
static llvm::StringRef getRemedy(llvm::StringRef callee) {
  if (callee.starts_with("std::") &&
      callee.ends_with("_distribution::operator()"))
    return "; compute it from what the engine gives, as in g() % 6 + 1 and "
           "float(g() >> 8) * 0x1p-24f";
  static const llvm::StringMap<llvm::StringRef> remedies = [] {
    llvm::StringMap<llvm::StringRef> table;
    auto add = [&](llvm::StringRef remedy,
                   std::initializer_list<llvm::StringRef> names) {
      for (llvm::StringRef name : names)
        table[name] = remedy;
    };
    add("; use std::partial_sort up to the end of the range, or sort(key) in a "
        "parallelFor",
        {"qsort", "std::qsort", "std::sort", "std::stable_sort",
         "std::ranges::__sort_fn::operator()",
         "std::ranges::__stable_sort_fn::operator()"});
    add("; use an array of a fixed size, or a buffer of the state",
        {"operator new", "operator new[]", "malloc", "calloc", "realloc",
         "aligned_alloc"});
    add("; write a loop over the elements",
        {"strlen", "strnlen", "strcmp", "strncmp", "strcpy", "strncpy",
         "strcat", "strchr", "strrchr", "strstr", "memchr", "memcmp", "bcmp",
         "bsearch", "std::equal"});
    add("; write the literal with its length, as in \"text\"sv",
        {"std::basic_string_view::basic_string_view"});
    add("; compare the character with the first and the last of its kind",
        {"tolower", "toupper", "isalnum", "isalpha", "isblank", "isdigit",
         "islower", "isprint", "ispunct", "isspace", "isupper", "isxdigit"});
    add("; write its real and its imaginary part, for complex numbers recover "
        "infinities from NaNs here",
        {"__mulsc3", "__muldc3", "__divsc3", "__divdc3"});
    add("; compute it from functions of piko::",
        {"erf", "erff", "erfc", "erfcf", "tgamma", "tgammaf", "lgamma",
         "lgammaf", "expm1f", "log1pf", "acoshf", "asinhf", "atanhf"});
    add("; store in a buffer of the state what the host is to see",
        {"printf", "puts", "putchar", "fprintf", "fputs", "fputc", "fwrite",
         "snprintf", "sprintf", "vprintf", "std::operator<<",
         "std::basic_ostream::operator<<"});
    add("; compute random numbers from a seed of the primitive's own",
        {"rand", "srand", "rand_r", "random", "drand48"});
    add("; let the host set a constant of the state",
        {"time", "clock", "clock_gettime", "getenv"});
    add("; return, and let the host see why in a buffer of the state",
        {"abort", "exit", "_Exit", "quick_exit", "__assert_fail"});
    return table;
  }();
  return remedies.lookup(callee);
}

/// Whether an intrinsic means something on this machine alone. A pause means
/// nothing anywhere.
static bool isMachineBuiltin(const llvm::Function &intrinsic) {
  llvm::StringRef name = intrinsic.getName();
  return (name.starts_with("llvm.x86.") || name.starts_with("llvm.aarch64.")) &&
         name != "llvm.x86.sse2.pause" && name != "llvm.aarch64.hint";
}

namespace {

class CallChecker {
public:
  CallChecker(ParsedUnit &unit, mlir::MLIRContext &context)
      : unit(unit), context(context) {}

  bool check(llvm::Function &function) {
    if (!visited.insert(&function).second)
      return true;
    stack.push_back(&function);
    for (llvm::Instruction &instruction : llvm::instructions(function)) {
      auto *call = dyn_cast<llvm::CallBase>(&instruction);
      if (call && !checkCall(call))
        return false;
      if (!checkReferences(instruction))
        return false;
    }
    stack.pop_back();
    return true;
  }

  /// Looks for allocation and for a user's own `throw` alone: what a container
  /// throws when it is too large is not why it is refused.
  bool checkAllocation(llvm::ArrayRef<llvm::Function *> functions) {
    llvm::SaveAndRestore only(onlyAllocation, true);
    bool ok = llvm::all_of(functions, [&](auto *f) { return check(*f); });
    visited.clear();
    callers.clear();
    return ok;
  }

private:
  /// How the user's text leads to a call.
  CallChain getChain(const llvm::CallBase *call, llvm::StringRef callee) {
    CallChain chain(unit);
    chain.add(call->getDebugLoc(), callee);
    for (llvm::Function *function : llvm::reverse(stack))
      if (const llvm::Instruction *caller = callers.lookup(function))
        chain.add(caller->getDebugLoc(), getName(function));
    return chain;
  }

  bool fail(const llvm::CallBase *call, llvm::StringRef callee,
            const llvm::Twine &what) {
    CallChain chain = getChain(call, callee);
    mlir::InFlightDiagnostic error = chain.emitError(context);
    error << "not supported in Piko: " << what;
    llvm::StringRef user = chain.getUserCallee();
    if (!user.empty())
      error << ", in a call of '" << user << "'";
    llvm::StringRef remedy = getRemedy(user);
    error << (remedy.empty() ? getRemedy(callee) : remedy);
    return false;
  }

  std::string getName(const llvm::Function *function) {
    auto found = unit.functionNames.find(function->getName().str());
    return found == unit.functionNames.end() ? function->getName().str()
                                             : found->second;
  }

  bool checkCall(llvm::CallBase *call) {
    if (call->isInlineAsm())
      return onlyAllocation || fail(call, "", "inline assembly");
    llvm::Function *callee = call->getCalledFunction();
    if (!callee)
      return true; // Known, or rejected, after inlining.
    if (llvm::StringRef math = getMathName(*callee); !math.empty())
      return onlyAllocation || getMissingMath(*callee).empty() ||
             fail(call, math, getMissingMath(*callee));
    if (callee->isIntrinsic())
      return onlyAllocation || !isMachineBuiltin(*callee) ||
             fail(call, callee->getName(),
                  "a builtin of this machine, '" + callee->getName() + "'");
    if (getMarker(call, unit.markers))
      return true;
    std::string name = getName(callee);
    if (callee->isDeclaration())
      return checkDeclaration(call, name);
    if (llvm::is_contained(stack, callee))
      return onlyAllocation ||
             fail(call, name, "recursion: '" + name + "' calls itself");
    return checkCallee(*callee, call);
  }

  bool checkDeclaration(const llvm::CallBase *call, llvm::StringRef name) {
    llvm::StringRef feature = getLanguageFeature(name);
    if (onlyAllocation)
      return feature.empty() ||
             (feature != "dynamic allocation" &&
              !getChain(call, name).getUserCallee().empty()) ||
             fail(call, name, feature);
    if (!feature.empty())
      return fail(call, name, feature);
    return fail(call, name,
                "a call of '" + name + "', which has no body in this file");
  }

  bool checkCallee(llvm::Function &callee, llvm::Instruction *user) {
    callee.removeFnAttr(llvm::Attribute::NoInline);
    callee.removeFnAttr(llvm::Attribute::OptimizeNone);
    callee.addFnAttr(llvm::Attribute::AlwaysInline);
    callers.try_emplace(&callee, user);
    return check(callee);
  }

  /// Functions that are passed to others are called, too.
  bool checkReferences(llvm::Instruction &instruction) {
    auto *call = dyn_cast<llvm::CallBase>(&instruction);
    for (llvm::Use &operand : instruction.operands()) {
      auto *function = dyn_cast<llvm::Function>(operand.get());
      if (!function || function->isDeclaration() ||
          (call && call->isCallee(&operand)))
        continue;
      if (!checkCallee(*function, &instruction))
        return false;
    }
    return true;
  }

  ParsedUnit &unit;
  mlir::MLIRContext &context;
  bool onlyAllocation = false;
  llvm::SmallVector<llvm::Function *> stack;
  llvm::DenseSet<llvm::Function *> visited;
  llvm::DenseMap<llvm::Function *, llvm::Instruction *> callers;
};

} // namespace

bool piko::checkCalls(llvm::ArrayRef<llvm::Function *> functions,
                      ParsedUnit &unit, mlir::MLIRContext &context) {
  CallChecker checker(unit, context);
  return checker.checkAllocation(functions) &&
         llvm::all_of(functions, [&](auto *f) { return checker.check(*f); });
}
