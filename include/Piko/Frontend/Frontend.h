//===- Frontend.h - From C++ to the piko dialect ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Clang parses a pipeline's C++ and generates LLVM IR for its phases; this
// library removes C++ from that IR and writes what is left in the piko dialect,
// at the authored level, with arith, math, scf and memref in the bodies.
//
// All diagnostics, Clang's own included, go to the context's diagnostic engine
// and point at the user's C++.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_FRONTEND_FRONTEND_H
#define PIKO_FRONTEND_FRONTEND_H

#include "Piko/Frontend/PipelineDescription.h"
#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/OwningOpRef.h"
#include "llvm/ADT/STLFunctionalExtras.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/VirtualFileSystem.h"

#include <memory>
#include <string>
#include <vector>

namespace piko {

/// Keeps precompiled headers from one compilation to the next.
class HeaderStore {
public:
  using Files = llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem>;
  using Maker =
      llvm::function_ref<std::optional<std::string>(const Files &files)>;

  virtual ~HeaderStore() = default;
  /// What `make` gives, or gave for the same arguments of Clang and the same
  /// files; null if it fails.
  virtual std::unique_ptr<llvm::MemoryBuffer>
  get(llvm::ArrayRef<std::string> arguments, const Files &files,
      Maker make) = 0;
};

struct FrontendOptions {
  /// `-I` and `-D`, without the letter.
  std::vector<std::string> includeDirs;
  std::vector<std::string> defines;
  /// The pipeline to compile; empty = the only one in the file.
  std::string pipeName;
  /// Where piko.h is.
  std::string runtimeIncludeDir;
  /// Clang's own headers; empty = those of the Clang that Piko was built with.
  std::string resourceDir;
  /// Where all files are read; null = the disk.
  llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files;
  /// Where there is a precompiled piko.h; null = nowhere.
  std::shared_ptr<HeaderStore> headers;
};

/// Compiles one pipeline of a C++ file; null after an error.
mlir::OwningOpRef<mlir::ModuleOp>
translateCppToPiko(llvm::StringRef file, const FrontendOptions &options,
                   mlir::MLIRContext &context);

/// The same for text in memory; `name` is what diagnostics call it.
mlir::OwningOpRef<mlir::ModuleOp>
translateCppToPiko(llvm::StringRef name, llvm::StringRef text,
                   const FrontendOptions &options, mlir::MLIRContext &context);

/// The names of the pipelines in a C++ file, in the order of their definition.
llvm::FailureOr<std::vector<std::string>>
listPipes(llvm::StringRef file, const FrontendOptions &options,
          mlir::MLIRContext &context);

/// A constant that a tuner may choose: a call of piko::tunable.
struct TunableDescription {
  std::string name = {};
  /// The standard value, then the others, as a user writes them: an enumerator
  /// by its name.
  std::vector<std::string> values = {};
  /// The same as PIKO_TUNED takes them.
  std::vector<std::string> texts = {};
  /// The first call.
  mlir::Location location;
};

/// The tunables of a C++ file and of the headers that are the user's, in the
/// order in which they stand there.
llvm::FailureOr<std::vector<TunableDescription>>
listTunables(llvm::StringRef file, const FrontendOptions &options,
             mlir::MLIRContext &context);

/// Defines PIKO_TUNED so that the file's tunables have these values, by their
/// names, as listTunables() writes them. An error if the file has no such
/// tunable, or it no such value. Without values, a PIKO_TUNED that names
/// enumerators gets their numbers.
llvm::LogicalResult
setTunables(llvm::StringRef file,
            llvm::ArrayRef<std::pair<std::string, std::string>> values,
            FrontendOptions &options, mlir::MLIRContext &context);

/// Reads a pipeline's stages, edges, state and records without compiling its
/// phases.
llvm::FailureOr<PipelineDescription>
describePipe(llvm::StringRef file, const FrontendOptions &options,
             mlir::MLIRContext &context);

struct ParseRequest;

/// The pipelines of a C++ file, which is parsed once for all of them.
class PipelineFile {
public:
  /// Reads the pipeline that the options name, or all if they name none. Null
  /// after an error, but not for one of several pipelines.
  static std::unique_ptr<PipelineFile> parse(llvm::StringRef file,
                                             const FrontendOptions &options,
                                             mlir::MLIRContext &context);
  static std::unique_ptr<PipelineFile> parse(const ParseRequest &request,
                                             mlir::MLIRContext &context);
  ~PipelineFile();

  /// Pipelines are numbered in the order of their definition; those with
  /// errors in their graph have no number.
  size_t size() const;
  llvm::StringRef getName(size_t index) const;
  /// What describePipe gives.
  llvm::FailureOr<PipelineDescription> describe(size_t index) const;
  /// What translateCppToPiko gives; to be called once for each pipeline.
  mlir::OwningOpRef<mlir::ModuleOp> translate(size_t index);

private:
  struct Unit;
  explicit PipelineFile(mlir::MLIRContext &context);

  mlir::MLIRContext &context;
  std::vector<std::unique_ptr<Unit>> units;
};

/// The text of a C++ program for the runtime's ABI that runs the pipelines with
/// the reference executor: `userFile` is included, without __PIKO__. It defines
/// `extern "C" const pikort_program *piko_reference_program(int)`, which takes
/// the place of a pipeline in the list.
std::string
generateReferenceAdapter(llvm::ArrayRef<PipelineDescription> pipelines,
                         llvm::StringRef userFile);

/// Registers `piko-translate --cpp-to-piko`.
void registerCppToPikoTranslation(std::shared_ptr<HeaderStore> headers);

} // namespace piko

#endif // PIKO_FRONTEND_FRONTEND_H
