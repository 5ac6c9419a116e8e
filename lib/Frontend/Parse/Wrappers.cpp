//===- Wrappers.cpp - C++ text around a pipeline's phases -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A wrapper builds the whole pipeline object locally, so that what its
// constructors set is known; inlining and SROA dissolve it.
//
//===----------------------------------------------------------------------===//

#include "Parse/Wrappers.h"

#include "llvm/IR/Module.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;

llvm::StringRef WrapperTable::add(WrapperKind kind, unsigned index) {
  wrappers.push_back(
      {"__piko_wrapper_" + std::to_string(wrappers.size()), {kind, index}});
  return wrappers.back().first;
}

const Wrapper *WrapperTable::lookup(const llvm::Function &function) const {
  for (const auto &[name, wrapper] : wrappers)
    if (name == function.getName())
      return &wrapper;
  return nullptr;
}

llvm::Function &WrapperTable::get(llvm::Module &module, WrapperKind kind,
                                  unsigned index) const {
  for (const auto &[name, wrapper] : wrappers)
    if (wrapper.kind == kind && wrapper.index == index)
      return *module.getFunction(name);
  llvm_unreachable("expected a wrapper that was generated");
}

std::string piko::generateWrappers(const PipelineDescription &pipeline,
                                   llvm::StringRef typeName,
                                   llvm::StringRef suffix,
                                   WrapperTable &wrappers) {
  std::string text;
  llvm::raw_string_ostream out(text);
  auto function = [&](WrapperKind kind, unsigned index, llvm::Twine body,
                      llvm::Twine phase = "") {
    out << "extern \"C\" void " << wrappers.add(kind, index) << suffix
        << "() { " << body << " }" << wrapperComment << phase << "\n";
  };
  out << "namespace __piko_wrappers" << suffix << " {\n";
  // A variable of the same name may hide the class.
  out << "using __piko_pipe = class " << typeName << ";\n";
  out << "using __piko_state = typename decltype(::piko::detail::stateOf("
         "static_cast<__piko_pipe *>(nullptr)))::type;\n";
  function(WrapperKind::Wire, 0, "__piko_pipe pipe;");
  for (auto [index, stage] : llvm::enumerate(pipeline.stages)) {
    std::string call =
        "__piko_pipe pipe; ::piko::marker::phase(); pipe." + stage.name;
    std::string type = "typename decltype(::piko::detail::inputOf(&pipe." +
                       stage.name + "))::type";
    std::string input = "(*::piko::marker::input<" + type + ">());";
    std::string primitive = pipeline.records[stage.input].name;
    function(
        WrapperKind::Process, index,
        call + ".process" +
            (stage.takesList ? "(::piko::List<" + type + ">());" : input),
        "process(const " +
            (stage.takesList ? "piko::List<" + primitive + ">" : primitive) +
            " &)");
    if (stage.hasAssign)
      function(WrapperKind::Assign, index, call + ".assignBin" + input,
               "assignBin(const " + primitive + " &)");
    if (stage.hasSchedule)
      function(WrapperKind::Schedule, index,
               call + ".schedule(::piko::BinId{::piko::marker::bin()});",
               "schedule(piko::BinId)");
  }
  for (auto [index, state] : llvm::enumerate(pipeline.state)) {
    if (state.isEvaluated)
      continue;
    if (state.hasValue)
      function(
          WrapperKind::Clear, index,
          "__piko_state state{}; ::piko::detail::initializeConstant(state." +
              state.name + ");");
    else if (state.kind == StateDescription::Image)
      function(WrapperKind::Clear, index,
               "::piko::detail::clearImage(::piko::marker::state<__piko_state>"
               "()->" +
                   state.name + ");");
  }
  out << "}\n";
  return text;
}
