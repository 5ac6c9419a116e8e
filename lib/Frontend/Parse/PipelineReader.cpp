//===- PipelineReader.cpp - Pipelines in Clang's AST ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Parse/PipelineReader.h"

#include "Parse/LanguageTypes.h"
#include "Parse/PhaseNames.h"
#include "mlir/IR/Diagnostics.h"
#include "Clang/ClangDiagnostics.h"
#include "clang/AST/RecordLayout.h"
#include "clang/Basic/SourceManager.h"

using namespace piko;
using clang::CXXRecordDecl;
using clang::QualType;
using llvm::dyn_cast;
using llvm::failed;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;
using mlir::emitError;

mlir::Location PipelineReader::locate(clang::SourceLocation location) const {
  return convertLocation(location, ast.getSourceManager(), context);
}

LogicalResult PipelineReader::read(const PipeCandidate &pipe) {
  const Specialization *base = findPikoBase(pipe.type, "Pipe");
  stateType = getTypeArgument(base, 0);
  if (failed(readState(stateType)))
    return failure();

  // Members of base classes first, as they are constructed.
  llvm::SmallVector<const CXXRecordDecl *> hierarchy;
  for (const CXXRecordDecl *type = pipe.type; type && type != base;) {
    hierarchy.push_back(type);
    const CXXRecordDecl *next = nullptr;
    for (const clang::CXXBaseSpecifier &specifier : type->bases())
      if (findPikoBase(specifier.getType()->getAsCXXRecordDecl(), "Pipe"))
        next = specifier.getType()->getAsCXXRecordDecl()->getDefinition();
    type = next;
  }
  for (const CXXRecordDecl *type : llvm::reverse(hierarchy))
    for (const clang::FieldDecl *member : type->fields())
      if (findPikoBase(member->getType()->getAsCXXRecordDecl(), "BasicStage") &&
          failed(readStage(member)))
        return failure();
  if (pipeline.stages.empty())
    return emitError(pipeline.location)
           << "expected pipeline '" << pipeline.name
           << "' to have a stage, but it has none";
  pipeline.rank = pipeline.stages.front().bins.size();
  for (const StageDescription &stage : pipeline.stages)
    if (static_cast<int64_t>(stage.bins.size()) != pipeline.rank) {
      mlir::InFlightDiagnostic diagnostic = emitError(stage.location);
      diagnostic << "expected the bins of stage '" << stage.name << "' to have "
                 << pipeline.rank << " dimensions, but they have "
                 << stage.bins.size();
      diagnostic.attachNote(pipeline.stages.front().location)
          << "stage '" << pipeline.stages.front().name << "' is declared here";
      return diagnostic;
    }
  for (const StateDescription &state : pipeline.state)
    if (state.kind == StateDescription::Image && state.rank != pipeline.rank) {
      mlir::InFlightDiagnostic diagnostic = emitError(state.location);
      diagnostic << "expected image '" << state.name << "' to have the "
                 << pipeline.rank
                 << " dimensions of the domain, which those of the bins are, "
                    "but it has "
                 << state.rank;
      diagnostic.attachNote(pipeline.stages.front().location)
          << "stage '" << pipeline.stages.front().name << "' is declared here";
      return diagnostic;
    }
  return success();
}

LogicalResult PipelineReader::readState(QualType type) {
  const CXXRecordDecl *decl = type->getAsCXXRecordDecl();
  if (!decl || !decl->hasDefinition())
    return emitError(pipeline.location) << "expected the state of pipeline '"
                                        << pipeline.name << "' to be a class";
  return readMembers(decl->getDefinition(), 0, /*hasConstructor=*/false);
}

static int64_t findBase(const CXXRecordDecl *decl, const CXXRecordDecl *wanted,
                        const clang::ASTContext &ast) {
  if (decl->getCanonicalDecl() == wanted->getCanonicalDecl())
    return 0;
  for (const clang::CXXBaseSpecifier &specifier : decl->bases()) {
    const CXXRecordDecl *base =
        specifier.getType()->getAsCXXRecordDecl()->getDefinition();
    if (int64_t at = findBase(base, wanted, ast); at >= 0)
      return at + ast.getASTRecordLayout(decl)
                      .getBaseClassOffset(base)
                      .getQuantity();
  }
  return -1;
}

int64_t PipelineReader::getStateOffset(QualType base) const {
  return findBase(stateType->getAsCXXRecordDecl()->getDefinition(),
                  base->getAsCXXRecordDecl(), ast);
}

LogicalResult PipelineReader::readMembers(const CXXRecordDecl *decl,
                                          int64_t offset, bool hasConstructor) {
  hasConstructor |= decl->hasUserProvidedDefaultConstructor();
  const clang::ASTRecordLayout &layout = ast.getASTRecordLayout(decl);
  if (decl->isDynamicClass())
    return emitError(locate(decl->getLocation()))
           << "not supported in Piko: virtual functions or bases of the state";
  for (const clang::CXXBaseSpecifier &specifier : decl->bases()) {
    const CXXRecordDecl *base =
        specifier.getType()->getAsCXXRecordDecl()->getDefinition();
    int64_t at = layout.getBaseClassOffset(base).getQuantity();
    if (failed(readMembers(base, offset + at, hasConstructor)))
      return failure();
  }
  for (const clang::FieldDecl *member : decl->fields())
    if (failed(readMember(member, offset, hasConstructor)))
      return failure();
  return success();
}

/// Whether a type is or holds images or buffers: its parts are pieces of state
/// of their own.
static bool holdsElements(QualType type, clang::ASTContext &ast) {
  const CXXRecordDecl *record =
      ast.getBaseElementType(type)->getAsCXXRecordDecl();
  if (!record || !record->hasDefinition())
    return false;
  if (asPikoTemplate(record, "Buffer") || asPikoTemplate(record, "Image"))
    return true;
  record = record->getDefinition();
  return llvm::any_of(record->bases(),
                      [&](const clang::CXXBaseSpecifier &base) {
                        return holdsElements(base.getType(), ast);
                      }) ||
         llvm::any_of(record->fields(), [&](const clang::FieldDecl *field) {
           return holdsElements(field->getType(), ast);
         });
}

LogicalResult PipelineReader::readMember(const clang::FieldDecl *member,
                                         int64_t offset, bool hasConstructor) {
  const auto *parent = llvm::cast<CXXRecordDecl>(member->getParent());
  offset +=
      ast.getASTRecordLayout(parent).getFieldOffset(member->getFieldIndex()) /
      8;
  std::string name = member->getNameAsString();
  QualType type = member->getType();
  if (holdsElements(type, ast))
    return readElements(member, type, name, offset);

  StateDescription state{name, StateDescription::Constant,   0, 0,
                         0,    locate(member->getLocation())};
  const CXXRecordDecl *single =
      ast.getBaseElementType(type)->getAsCXXRecordDecl();
  state.hasValue = hasConstructor || member->hasInClassInitializer() ||
                   (single && single->hasDefinition() &&
                    single->getDefinition()->hasNonTrivialDefaultConstructor());
  state.offset = offset;
  return addState(std::move(state), {member, type, hasConstructor});
}

/// Reads an image, a buffer, or an array or a class of them.
LogicalResult PipelineReader::readElements(const clang::FieldDecl *member,
                                           QualType type,
                                           const std::string &name,
                                           int64_t offset) {
  if (const auto *array = ast.getAsConstantArrayType(type)) {
    QualType element = array->getElementType();
    int64_t size = ast.getTypeSizeInChars(element).getQuantity();
    for (uint64_t i = 0; i < array->getZExtSize(); ++i)
      if (failed(readElements(member, element,
                              name + "[" + std::to_string(i) + "]",
                              offset + int64_t(i) * size)))
        return failure();
    return success();
  }
  const CXXRecordDecl *record = type->getAsCXXRecordDecl()->getDefinition();
  StateDescription state{name, StateDescription::Buffer,     0, 1,
                         0,    locate(member->getLocation())};
  state.offset = offset;
  if (const Specialization *buffer = asPikoTemplate(record, "Buffer"))
    return addState(std::move(state),
                    {member, getTypeArgument(buffer, 0), false});
  if (const Specialization *image = asPikoTemplate(record, "Image")) {
    state.kind = StateDescription::Image;
    state.rank = image->getTemplateArgs()[1].getAsIntegral().getSExtValue();
    return addState(std::move(state),
                    {member, getTypeArgument(image, 0), false});
  }
  const clang::ASTRecordLayout &layout = ast.getASTRecordLayout(record);
  if (record->isUnion() || record->getNumBases() > 0)
    return emitError(state.location)
           << "not supported in Piko: a union or a class with bases that holds "
              "images or buffers, as '"
           << name << "' is";
  for (const clang::FieldDecl *field : record->fields()) {
    std::string part = name + "." + field->getNameAsString();
    if (!holdsElements(field->getType(), ast))
      return emitError(locate(field->getLocation()))
             << "expected a class of images or buffers to hold nothing else; "
                "put '"
             << part << "' into the state itself";
    if (failed(readElements(
            field, field->getType(), part,
            offset + layout.getFieldOffset(field->getFieldIndex()) / 8)))
      return failure();
  }
  return success();
}

LogicalResult PipelineReader::addState(StateDescription state,
                                       const StateMember &member) {
  for (const StateDescription &other : pipeline.state)
    if (other.name == state.name) {
      mlir::InFlightDiagnostic diagnostic = emitError(state.location);
      diagnostic
          << "expected the members of the state and of its bases to have "
             "different names, but there are two of the name '"
          << state.name << "'";
      diagnostic.attachNote(other.location) << "the other one is here";
      return diagnostic;
    }
  llvm::FailureOr<unsigned> record =
      records.get(member.type, state.location, state.name);
  if (failed(record))
    return failure();
  state.record = *record;
  pipeline.state.push_back(std::move(state));
  stateMembers.push_back(member);
  return success();
}

LogicalResult PipelineReader::readStage(const clang::FieldDecl *member) {
  const CXXRecordDecl *type =
      member->getType()->getAsCXXRecordDecl()->getDefinition();
  StageDescription stage{.name = member->getNameAsString(),
                         .typeName = records.getName(member->getType()),
                         .location = locate(member->getLocation())};
  const auto *parent = llvm::cast<CXXRecordDecl>(member->getParent());
  stage.offset =
      ast.getASTRecordLayout(parent).getFieldOffset(member->getFieldIndex()) /
      8;

  const Specialization *base = findPikoBase(type, "BasicStage");
  if (failed(readTemplate(base, stage)) ||
      failed(readPhases(type, getTypeArgument(base, 2), stage)))
    return failure();
  if (const Specialization *uses = findPikoBase(type, "Uses")) {
    QualType used = getTypeArgument(uses, 0);
    const CXXRecordDecl *base = used->getAsCXXRecordDecl();
    if (!ast.hasSameType(used, stateType) &&
        !(base && stateType->getAsCXXRecordDecl()->isDerivedFrom(base)))
      return emitError(stage.location)
             << "expected stage '" << stage.name << "' to use the state '"
             << records.getName(stateType) << "' of its pipeline, but it uses '"
             << records.getName(used) << "'";
  }
  stage.symbol = stage.name;
  while (llvm::any_of(pipeline.state, [&](const StateDescription &state) {
    return state.name == stage.symbol;
  }))
    stage.symbol += "_stage";
  stageTypes.push_back(type->getCanonicalDecl());
  pipeline.stages.push_back(std::move(stage));
  return success();
}

LogicalResult PipelineReader::readTemplate(const Specialization *base,
                                           StageDescription &stage) {
  const clang::TemplateArgumentList &arguments = base->getTemplateArgs();
  const auto *bins = llvm::cast<Specialization>(
      arguments[0].getAsType()->getAsCXXRecordDecl());
  for (const clang::TemplateArgument &size :
       bins->getTemplateArgs()[0].pack_elements())
    stage.bins.push_back(size.getAsIntegral().getSExtValue());
  stage.threads = arguments[1].getAsIntegral().getSExtValue();

  llvm::FailureOr<unsigned> input =
      records.get(arguments[2].getAsType(), stage.location);
  if (failed(input))
    return failure();
  stage.input = *input;
  for (const clang::TemplateArgument &type : arguments[3].pack_elements()) {
    llvm::FailureOr<unsigned> output =
        records.get(type.getAsType(), stage.location);
    if (failed(output))
      return failure();
    stage.outputs.push_back(*output);
  }
  return success();
}

/// Whether a class or one of its bases declares a function of that name;
/// `found` gets it.
static bool declares(const CXXRecordDecl *type, llvm::StringRef name,
                     const clang::NamedDecl *&found) {
  if (!type || !type->hasDefinition())
    return false;
  type = type->getDefinition();
  for (const clang::Decl *decl : type->decls()) {
    const auto *named = dyn_cast<clang::NamedDecl>(decl);
    if (named && named->getDeclName().isIdentifier() &&
        named->getName() == name &&
        llvm::isa<clang::CXXMethodDecl, clang::FunctionTemplateDecl>(named)) {
      found = named;
      return true;
    }
  }
  for (const clang::CXXBaseSpecifier &base : type->bases())
    if (declares(base.getType()->getAsCXXRecordDecl(), name, found))
      return true;
  return false;
}

/// Expects a phase to take the primitive itself: what that can be converted to
/// would be another value. What cannot be called at all is reported by Clang.
LogicalResult PipelineReader::checkParameter(const clang::NamedDecl *phase,
                                             QualType input) {
  const auto *method = dyn_cast<clang::CXXMethodDecl>(phase);
  if (!method || method->getNumParams() != 1)
    return success();
  QualType taken = method->getParamDecl(0)->getType().getNonReferenceType();
  const CXXRecordDecl *base = taken->getAsCXXRecordDecl();
  const CXXRecordDecl *derived = input->getAsCXXRecordDecl();
  if (ast.hasSameUnqualifiedType(taken, input) ||
      (base && derived && base->hasDefinition() && derived->hasDefinition() &&
       derived->isDerivedFrom(base)))
    return success();
  std::string name = phase->getNameAsString();
  return emitError(locate(method->getParamDecl(0)->getLocation()))
         << "expected " << name << "(const " << records.getName(input)
         << " &), but got " << name << "(const " << records.getName(taken)
         << " &)";
}

/// Expects a phase that the reference executor may call, too.
LogicalResult PipelineReader::checkAccess(const clang::NamedDecl *phase,
                                          const StageDescription &stage) {
  if (phase->getAccess() == clang::AS_public ||
      phase->getAccess() == clang::AS_none)
    return success();
  std::string name = phase->getNameAsString();
  return emitError(locate(phase->getLocation()))
         << "expected phase '" << name << "' of stage '" << stage.name
         << "' to be public, because the executor calls it; write 'public:' "
            "before it";
}

LogicalResult PipelineReader::readPhases(const CXXRecordDecl *type,
                                         QualType input,
                                         StageDescription &stage) {
  const clang::NamedDecl *process = nullptr, *assign = nullptr,
                         *schedule = nullptr;
  mlir::Location where = locate(type->getLocation());
  if (!declares(type, "process", process)) {
    mlir::InFlightDiagnostic diagnostic = emitError(where);
    diagnostic << "expected stage '" << stage.name
               << "' to have a process phase, but '" << stage.typeName
               << "' has none";
    noteSimilarNames(type, "process", ast, diagnostic, context);
    return diagnostic;
  }
  stage.processLocation = locate(process->getLocation());
  if (const auto *method = dyn_cast<clang::CXXMethodDecl>(process))
    if (method->getNumParams() == 1) {
      QualType parameter = method->getParamDecl(0)->getType();
      stage.takesList = asPikoTemplate(
          parameter.getNonReferenceType()->getAsCXXRecordDecl(), "List");
    }
  if (!stage.takesList && failed(checkParameter(process, input)))
    return failure();
  stage.hasAssign = declares(type, "assignBin", assign);
  if (stage.hasAssign)
    stage.assignLocation = locate(assign->getLocation());
  if (stage.hasAssign && failed(checkParameter(assign, input)))
    return failure();
  stage.hasSchedule = declares(type, "schedule", schedule);
  for (const clang::NamedDecl *phase : {process, assign, schedule})
    if (phase && failed(checkAccess(phase, stage)))
      return failure();
  if (!stage.hasAssign && !stage.isWholeDomain()) {
    mlir::InFlightDiagnostic diagnostic = emitError(where);
    diagnostic << "expected stage '" << stage.name
               << "' to have an assignBin phase, because its bins are smaller "
                  "than the domain";
    noteSimilarNames(type, "assignBin", ast, diagnostic, context);
    return diagnostic;
  }
  return success();
}
