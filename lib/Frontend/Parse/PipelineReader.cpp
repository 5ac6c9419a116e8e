//===- PipelineReader.cpp - Pipelines in Clang's AST ----------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Types are known by their declarations (a class template of that name in
// namespace piko), never by how a user spells them.
//
//===----------------------------------------------------------------------===//

#include "Parse/PipelineReader.h"

#include "Parse/ClangDiagnostics.h"
#include "Parse/PhaseNames.h"
#include "mlir/IR/Diagnostics.h"
#include "clang/AST/DeclTemplate.h"
#include "clang/AST/RecordLayout.h"
#include "clang/Basic/SourceManager.h"
#include "clang/Sema/Sema.h"
#include "llvm/ADT/StringMap.h"

using namespace piko;
using clang::CXXRecordDecl;
using clang::QualType;
using llvm::dyn_cast;
using llvm::failed;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;
using mlir::emitError;

using Specialization = clang::ClassTemplateSpecializationDecl;

/// `decl` as a specialization of piko::`name`, or null.
static const Specialization *asPikoTemplate(const CXXRecordDecl *decl,
                                            llvm::StringRef name) {
  const auto *specialization = llvm::dyn_cast_or_null<Specialization>(decl);
  if (!specialization || specialization->getName() != name)
    return nullptr;
  const auto *space =
      dyn_cast<clang::NamespaceDecl>(specialization->getDeclContext());
  bool isPiko = space && space->getName() == "piko" &&
                space->getParent()->isTranslationUnit();
  return isPiko ? specialization : nullptr;
}

/// The base of `decl` that is a specialization of piko::`name`, or null.
static const Specialization *findPikoBase(const CXXRecordDecl *decl,
                                          llvm::StringRef name) {
  if (!decl || !decl->hasDefinition())
    return nullptr;
  if (const Specialization *self = asPikoTemplate(decl, name))
    return self;
  for (const clang::CXXBaseSpecifier &base : decl->bases())
    if (const Specialization *found =
            findPikoBase(base.getType()->getAsCXXRecordDecl(), name))
      return found;
  return nullptr;
}

static QualType getTypeArgument(const Specialization *type, unsigned index) {
  return type->getTemplateArgs()[index].getAsType();
}

//===----------------------------------------------------------------------===//
// Finding pipelines
//===----------------------------------------------------------------------===//

static bool willDeriveFrom(const CXXRecordDecl *pattern, llvm::StringRef name);

/// Whether a type, which may be a template's, will be a piko::`name`.
static bool willBe(QualType type, llvm::StringRef name) {
  if (findPikoBase(type->getAsCXXRecordDecl(), name))
    return true;
  const auto *made = type->getAs<clang::TemplateSpecializationType>();
  const clang::TemplateDecl *of =
      made ? made->getTemplateName().getAsTemplateDecl() : nullptr;
  if (!of)
    return false;
  if (const auto *alias = dyn_cast<clang::TypeAliasTemplateDecl>(of))
    return willBe(alias->getTemplatedDecl()->getUnderlyingType(), name);
  return of->getQualifiedNameAsString() == ("piko::" + name).str() ||
         willDeriveFrom(
             llvm::dyn_cast_or_null<CXXRecordDecl>(of->getTemplatedDecl()),
             name);
}

static bool willDeriveFrom(const CXXRecordDecl *pattern, llvm::StringRef name) {
  return pattern && pattern->hasDefinition() &&
         llvm::any_of(pattern->getDefinition()->bases(),
                      [&](const clang::CXXBaseSpecifier &base) {
                        return willBe(base.getType(), name);
                      });
}

bool piko::isStage(const CXXRecordDecl *type) {
  return willDeriveFrom(type, "BasicStage");
}

/// With namespaces and classes, but for those without a name.
static std::string getQualifiedName(const clang::NamedDecl *decl) {
  std::string name = decl->getNameAsString();
  for (const clang::DeclContext *scope = decl->getDeclContext(); scope;
       scope = scope->getParent()) {
    const auto *outer = dyn_cast<clang::NamedDecl>(scope);
    if (outer && !outer->getNameAsString().empty())
      name = outer->getNameAsString() + "::" + name;
  }
  return name;
}

static void collectPipes(const clang::DeclContext *scope, clang::Sema &sema,
                         std::vector<PipeCandidate> &pipes) {
  clang::ASTContext &ast = sema.getASTContext();
  // What is in a precompiled header is none.
  for (const clang::Decl *decl : scope->noload_decls()) {
    if (const auto *space = dyn_cast<clang::NamespaceDecl>(decl)) {
      if (!space->isStdNamespace() && space->getName() != "glm")
        collectPipes(space, sema, pipes);
      continue;
    }
    if (const auto *link = dyn_cast<clang::LinkageSpecDecl>(decl)) {
      collectPipes(link, sema, pipes);
      continue;
    }
    if (ast.getSourceManager().isInSystemHeader(decl->getLocation()))
      continue;
    const CXXRecordDecl *type = nullptr;
    if (const auto *alias = dyn_cast<clang::TypedefNameDecl>(decl)) {
      QualType target = alias->getUnderlyingType();
      type = target->getAsCXXRecordDecl();
      const auto *made = llvm::dyn_cast_or_null<Specialization>(type);
      if (!made || type->isDependentContext() || target->isDependentType() ||
          !willDeriveFrom(made->getSpecializedTemplate()->getTemplatedDecl(),
                          "Pipe") ||
          !sema.isCompleteType(decl->getLocation(), target))
        continue;
    } else if (const auto *record = dyn_cast<CXXRecordDecl>(decl)) {
      if (!record->isThisDeclarationADefinition() || record->isInvalidDecl() ||
          record->isDependentContext() || record->isImplicit())
        continue;
      type = record;
    }
    const auto *named = dyn_cast<clang::NamedDecl>(decl);
    if (type && findPikoBase(type, "Pipe"))
      pipes.push_back({named->getNameAsString(), getQualifiedName(named), type,
                       decl->getLocation()});
    if (type && type == decl)
      collectPipes(type, sema, pipes);
  }
}

/// Tells those apart that have one name.
static void qualifyNames(std::vector<PipeCandidate> &pipes) {
  llvm::StringMap<unsigned> counts;
  for (const PipeCandidate &pipe : pipes)
    ++counts[pipe.name];
  for (PipeCandidate &pipe : pipes)
    if (counts[pipe.name] > 1)
      pipe.name = pipe.qualifiedName;
}

/// Instantiates a class and what it, its bases and its members name as template
/// arguments: primitives and records of state, which nothing else may need.
static void instantiate(QualType type, clang::SourceLocation location,
                        clang::Sema &sema,
                        llvm::SmallPtrSetImpl<const clang::Type *> &visited) {
  type = sema.getASTContext().getBaseElementType(type.getCanonicalType());
  if (type->isDependentType() || !type->isRecordType() ||
      !visited.insert(type.getTypePtr()).second ||
      !sema.isCompleteType(location, type))
    return;
  auto visit = [&](QualType part) {
    instantiate(part, location, sema, visited);
  };
  auto visitArguments = [&](llvm::ArrayRef<clang::TemplateArgument> arguments,
                            const auto &self) -> void {
    for (const clang::TemplateArgument &argument : arguments)
      if (argument.getKind() == clang::TemplateArgument::Type)
        visit(argument.getAsType());
      else if (argument.getKind() == clang::TemplateArgument::Pack)
        self(argument.pack_elements(), self);
  };
  const CXXRecordDecl *record = type->getAsCXXRecordDecl()->getDefinition();
  if (const auto *made = dyn_cast<Specialization>(record))
    visitArguments(made->getTemplateArgs().asArray(), visitArguments);
  for (const clang::CXXBaseSpecifier &base : record->bases())
    visit(base.getType());
  for (const clang::FieldDecl *field : record->fields())
    visit(field->getType());
}

std::vector<PipeCandidate> piko::findPipes(clang::Sema &sema) {
  std::vector<PipeCandidate> pipes;
  clang::ASTContext &ast = sema.getASTContext();
  collectPipes(ast.getTranslationUnitDecl(), sema, pipes);
  qualifyNames(pipes);
  llvm::SmallPtrSet<const clang::Type *, 32> visited;
  for (const PipeCandidate &pipe : pipes)
    instantiate(ast.getCanonicalTagType(pipe.type), pipe.location, sema,
                visited);
  return pipes;
}

llvm::FailureOr<PipeCandidate>
piko::selectPipe(const std::vector<PipeCandidate> &pipes, llvm::StringRef name,
                 mlir::Location file, clang::ASTContext &ast,
                 mlir::MLIRContext &context) {
  if (pipes.empty()) {
    emitError(file) << "expected a pipeline (a class that derives from "
                       "piko::Pipe), but the file defines none";
    return failure();
  }
  if (name.empty() && pipes.size() == 1)
    return pipes.front();
  // A name that several have is part of what each is called.
  std::string inner = ("::" + name).str();
  std::vector<const PipeCandidate *> meant;
  for (const PipeCandidate &pipe : pipes) {
    if (pipe.qualifiedName == name)
      return pipe;
    if (!name.empty() && llvm::StringRef(pipe.qualifiedName).ends_with(inner))
      meant.push_back(&pipe);
  }
  if (meant.size() == 1)
    return *meant.front();

  mlir::InFlightDiagnostic diagnostic = emitError(file);
  if (meant.size() > 1)
    diagnostic << "expected the name of one pipeline, but '" << name
               << "' is that of " << meant.size();
  else if (name.empty())
    diagnostic << "expected the name of one of the file's " << pipes.size()
               << " pipelines";
  else
    diagnostic << "expected the name of a pipeline, but got '" << name << "'";
  for (const PipeCandidate &pipe : pipes)
    if (meant.empty() || llvm::is_contained(meant, &pipe))
      diagnostic.attachNote(
          convertLocation(pipe.location, ast.getSourceManager(), context))
          << "pipeline '" << pipe.name << "' is defined here";
  return failure();
}

//===----------------------------------------------------------------------===//
// Reading one
//===----------------------------------------------------------------------===//

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
         << "' to be public, because the executor calls it; write 'public:' in "
            "front of it";
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
