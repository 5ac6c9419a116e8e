//===- CallChain.cpp - How a user's text leads to an instruction ----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Support/CallChain.h"

#include "llvm/Demangle/Demangle.h"
#include "llvm/IR/Instruction.h"

using namespace piko;

static mlir::Location convert(const llvm::DILocation *at,
                              mlir::MLIRContext &context) {
  return mlir::FileLineColLoc::get(&context, at->getFilename(), at->getLine(),
                                   at->getColumn());
}

static bool isUsers(const llvm::DILocation *at, const ParsedUnit &unit) {
  return at->getLine() != 0 && unit.userFiles.contains(at->getFilename());
}

mlir::Location piko::getUserLocation(const llvm::Instruction *instruction,
                                     const ParsedUnit &unit,
                                     mlir::MLIRContext &context) {
  for (const llvm::DILocation *at = instruction->getDebugLoc(); at;
       at = at->getInlinedAt())
    if (isUsers(at, unit))
      return convert(at, context);
  return unit.pipeline.location;
}

CallChain::CallChain(const llvm::Instruction *instruction,
                     const ParsedUnit &unit)
    : unit(unit) {
  std::string callee;
  for (const llvm::DILocation *at = instruction->getDebugLoc(); at;
       at = at->getInlinedAt()) {
    add(at, callee);
    callee = unit.programNames.lookup(at->getScope()->getSubprogram());
  }
}

void CallChain::add(const llvm::DILocation *at, llvm::StringRef callee) {
  frames.push_back({at, callee.str()});
}

bool CallChain::isUsers(const CallSite &frame) const {
  return frame.at && ::isUsers(frame.at, unit);
}

size_t CallChain::findUserFrame() const {
  return llvm::find_if(frames,
                       [&](const CallSite &frame) { return isUsers(frame); }) -
         frames.begin();
}

llvm::StringRef CallChain::getUserCallee() const {
  size_t place = findUserFrame();
  return place == 0 || place == frames.size()
             ? llvm::StringRef()
             : llvm::StringRef(frames[place].callee);
}

mlir::Location CallChain::getLocation(mlir::MLIRContext &context) const {
  size_t place = findUserFrame();
  return place == frames.size() ? unit.pipeline.location
                                : convert(frames[place].at, context);
}

/// Piko's own functions do what the user asked for: they explain nothing.
static bool isOurs(llvm::StringRef function) {
  return function.starts_with("piko::");
}

void CallChain::attachCallsAfter(mlir::InFlightDiagnostic &error, size_t place,
                                 mlir::MLIRContext &context) const {
  for (size_t i = place; i-- > 0;) {
    const CallSite &frame = frames[i];
    llvm::StringRef function = frames[i + 1].callee;
    if (!frame.at || frame.at->getLine() == 0 || function.empty() ||
        isOurs(function) || isOurs(frame.callee))
      continue;
    mlir::Diagnostic &note = error.attachNote(convert(frame.at, context));
    if (frame.callee.empty())
      note << "'" << function << "' does it here";
    else
      note << "'" << function << "' calls '" << frame.callee << "' here";
  }
}

void CallChain::attachCallers(mlir::InFlightDiagnostic &error, size_t place,
                              mlir::MLIRContext &context) const {
  // What a parallelFor runs is written where it is called.
  for (const CallSite &frame : llvm::drop_begin(frames, place + 1))
    if (isUsers(frame) && !isOurs(frame.callee))
      error.attachNote(convert(frame.at, context)) << "called from here";
}

mlir::InFlightDiagnostic
CallChain::emitError(mlir::MLIRContext &context) const {
  mlir::InFlightDiagnostic error = mlir::emitError(getLocation(context));
  size_t place = findUserFrame();
  if (place == frames.size())
    return error;
  attachCallers(error, place, context);
  attachCallsAfter(error, place, context);
  return error;
}

mlir::InFlightDiagnostic
piko::emitUserError(const llvm::Instruction *instruction,
                    const ParsedUnit &unit, mlir::MLIRContext &context) {
  return CallChain(instruction, unit).emitError(context);
}

std::string piko::describeVariable(llvm::StringRef mangledName) {
  if (mangledName.starts_with(".str"))
    return "a string";
  std::string name = llvm::demangle(mangledName);
  llvm::StringRef rest = name;
  rest.consume_front("guard variable for ");
  // What is local to a function is known by its own name.
  bool isLocal =
      mangledName.starts_with("_ZZ") || mangledName.starts_with("_ZGVZ");
  if (size_t scope = rest.rfind("::"); isLocal && scope != rest.npos)
    rest = rest.drop_front(scope + 2);
  return ("the variable '" + rest + "'").str();
}
