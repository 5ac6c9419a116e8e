// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A program whose code is there for several processors.
//
//   setup:  pikoir_setup_version(p, {{processor, needs, setup, run}, ...}, n)
//
// The choice is the runtime's, when a pipeline is created: no variable of the
// object changes, and nothing runs before main. Functions say which processor
// they are for: the optimizer and the code generator look at that, and not at
// the machine that the module is for.

#include "Piko/Target/Versions.h"

#include "llvm/ADT/STLExtras.h"
#include "llvm/ADT/StringExtras.h"
#include "llvm/IR/Constants.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/Linker/Linker.h"

#include "pikort/pikort.h"

using namespace llvm;
using namespace piko;

static void setProcessor(Function &function, StringRef name,
                         StringRef features) {
  function.addFnAttr("target-cpu", name);
  function.addFnAttr("target-features", features);
}

static void hide(Module &module) {
  for (GlobalValue &value : module.global_values())
    if (!value.isDeclaration())
      value.setLinkage(GlobalValue::InternalLinkage);
}

static Constant *getString(Module &module, StringRef text) {
  auto *value = ConstantDataArray::getString(module.getContext(), text);
  return new GlobalVariable(module, value->getType(), /*isConstant=*/true,
                            GlobalValue::PrivateLinkage, value);
}

namespace {
/// A program's functions, for one processor.
struct Version {
  const Processor &processor;
  std::string setup, run; ///< Their names.
};
} // namespace

/// Makes the functions of a module those of a processor. Names are unlike those
/// of other versions where there are any.
static Version makeVersion(Module &module, StringRef pipeline,
                           const Processor &processor, bool isOnly) {
  std::string suffix = isOnly ? "" : "." + processor.getLabel();
  for (Function &function : module) {
    if (function.isDeclaration())
      continue;
    setProcessor(function, processor.name, processor.features);
    function.setName(function.getName() + suffix);
  }
  hide(module);
  Version version{processor, (pipeline + ".setup" + suffix).str(),
                  (pipeline + ".run" + suffix).str()};
  // Of what is hidden the linker takes only what the rest needs.
  for (const std::string &name : {version.setup, version.run})
    module.getFunction(name)->setLinkage(GlobalValue::ExternalLinkage);
  return version;
}

/// A pikoir_version for each version.
static GlobalVariable *makeTable(Module &module, ArrayRef<Version> versions) {
  SmallVector<Constant *> entries;
  for (const Version &version : versions) {
    Constant *members[] = {
        getString(module, version.processor.getLabel()),
        getString(module, llvm::join(version.processor.needs, ",")),
        module.getFunction(version.setup), module.getFunction(version.run)};
    entries.push_back(ConstantStruct::getAnon(members));
  }
  auto *type = ArrayType::get(entries[0]->getType(), entries.size());
  return new GlobalVariable(module, type, /*isConstant=*/true,
                            GlobalValue::PrivateLinkage,
                            ConstantArray::get(type, entries));
}

/// The program's setup, which must run on every machine.
static Function *makeSetup(Module &module, StringRef pipeline,
                           ArrayRef<Version> versions) {
  LLVMContext &context = module.getContext();
  auto *pointer = PointerType::getUnqual(context);
  auto *count = Type::getInt32Ty(context);
  auto *type = FunctionType::get(Type::getVoidTy(context), pointer, false);
  auto *setup = Function::Create(type, GlobalValue::InternalLinkage,
                                 pipeline + ".setup_version", module);
  setProcessor(*setup, getBaseProcessor(module.getTargetTriple()), "");
  IRBuilder<> builder(BasicBlock::Create(context, "entry", setup));
  FunctionCallee choose = module.getOrInsertFunction(
      "pikoir_setup_version",
      FunctionType::get(Type::getVoidTy(context), {pointer, pointer, count},
                        false));
  builder.CreateCall(choose, {setup->getArg(0), makeTable(module, versions),
                              ConstantInt::get(count, versions.size())});
  builder.CreateRetVoid();
  return setup;
}

std::unique_ptr<Module>
piko::defineProgram(std::vector<std::unique_ptr<Module>> modules,
                    StringRef pipeline, StringRef symbol,
                    ArrayRef<Processor> processors, const Triple &triple) {
  SmallVector<Version> versions;
  for (auto [processor, part] : llvm::zip_equal(processors, modules)) {
    part->setTargetTriple(triple);
    versions.push_back(
        makeVersion(*part, pipeline, processor, modules.size() == 1));
  }
  std::unique_ptr<Module> program = std::move(modules.front());
  for (std::unique_ptr<Module> &part : llvm::drop_begin(modules))
    Linker::linkModules(*program, std::move(part));
  Constant *run = program->getFunction(versions.front().run);
  hide(*program);
  Constant *members[] = {
      ConstantInt::get(Type::getInt32Ty(program->getContext()),
                       PIKORT_ABI_VERSION),
      getString(*program, pipeline), makeSetup(*program, pipeline, versions),
      run};
  Constant *value = ConstantStruct::getAnon(members);
  new GlobalVariable(*program, value->getType(), /*isConstant=*/true,
                     GlobalValue::ExternalLinkage, value, symbol);
  return program;
}
