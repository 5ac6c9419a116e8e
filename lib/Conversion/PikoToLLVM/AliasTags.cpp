// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Each load, store and call says in TBAA what it touches: of state and of
// primitives each field by itself, and what is the runtime's own. So LLVM keeps
// in registers what an access does not touch.

#include "PikoToLLVM/AliasTags.h"

#include "PikoToLLVM/RuntimeABI.h"

#include "Piko/Conversion/AliasNames.h"

using namespace mlir;
using namespace piko;

LLVM::TBAANodeAttr AliasTags::root() const {
  return LLVM::TBAARootAttr::get(context,
                                 StringAttr::get(context, aliasNames::root));
}

LLVM::TBAATypeDescriptorAttr AliasTags::node(const Twine &name,
                                             LLVM::TBAANodeAttr parent) const {
  return LLVM::TBAATypeDescriptorAttr::get(
      context, StringAttr::get(context, name).getValue(),
      LLVM::TBAAMemberAttr::get(parent, 0));
}

LLVM::TBAATypeDescriptorAttr AliasTags::runtime() const {
  return node(aliasNames::runtime, root());
}

ArrayAttr AliasTags::tag(LLVM::TBAATypeDescriptorAttr node,
                         bool isConstant) const {
  return ArrayAttr::get(
      context,
      {LLVM::TBAATagAttr::get(context, node, node, /*offset=*/0, isConstant)});
}

ArrayAttr AliasTags::state(StringRef name, StringRef field,
                           bool isConstant) const {
  return tag(node("state " + name + "." + field, root()), isConstant);
}

ArrayAttr AliasTags::primitive(StringRef record, StringRef field) const {
  return tag(node("primitive " + record + "." + field, runtime()));
}

ArrayAttr AliasTags::record() const { return tag(runtime()); }

ArrayAttr AliasTags::dirty() const { return tag(node("dirty", root())); }

ArrayAttr AliasTags::writer() const {
  return tag(node(aliasNames::writer, runtime()));
}

ArrayAttr AliasTags::input() const { return tag(node("input", runtime())); }

ArrayAttr AliasTags::call(StringRef function) const {
  if (isFailure(function))
    return tag(node("failure", root()));
  static constexpr StringRef emissions[] = {
      PIKO_RUNTIME_FUNCTION(pikoir_place_source).name,
      PIKO_RUNTIME_FUNCTION(pikoir_reorder_begin).name,
      PIKO_RUNTIME_FUNCTION(pikoir_reorder_end).name,
      PIKO_RUNTIME_FUNCTION(pikoir_reorder_iteration).name,
      PIKO_RUNTIME_FUNCTION(pikoir_scratch_mark).name,
      PIKO_RUNTIME_FUNCTION(pikoir_scratch).name,
      PIKO_RUNTIME_FUNCTION(pikoir_scratch_release).name};
  if (llvm::is_contained(emissions, function))
    return tag(runtime());
  return ArrayAttr();
}
