// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the patterns of convert-piko-to-llvm share: the numbers that the runtime
// knows stages and state by, calls of the runtime, and values that a kernel
// function computes once, in its entry block.

#ifndef PIKO_LIB_CONVERSION_PIKOTOLLVM_LOWERINGCONTEXT_H
#define PIKO_LIB_CONVERSION_PIKOTOLLVM_LOWERINGCONTEXT_H

#include "PikoToLLVM/AliasTags.h"
#include "PikoToLLVM/RuntimeABI.h"

#include "Piko/Conversion/Passes.h"

#include "mlir/Transforms/DialectConversion.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/StringMap.h"

namespace piko {

/// What a kernel reduces to private copies of; see PrivateCopyOp.
struct Reduction {
  mlir::StringAttr stage, state, field;
  AtomicKind kind;
  bool often;
};

/// What a kernel selects pixels of; see PrivateImagesOp.
struct ImageSelection {
  mlir::StringAttr stage, unitImage;
  llvm::SmallVector<mlir::StringAttr> images;
  mlir::DenseI64ArrayAttr numbers;
  mlir::ArrayAttr comparisons, kept;
  bool last, often;
};

/// What the runtime calls a pipeline's parts.
struct PipelineNumbers {
  PipelineOp pipeline;
  llvm::MapVector<mlir::StringAttr, int32_t> stages, states, records;
  /// Buffers that kernels change.
  llvm::DenseSet<mlir::StringAttr> writtenBuffers;
  /// Buffers that no kernel uses.
  llvm::DenseSet<mlir::StringAttr> unusedBuffers;
  llvm::SmallVector<Reduction> reductions;
  llvm::SmallVector<ImageSelection> selections;

  explicit PipelineNumbers(PipelineOp pipeline);
  /// The number of a reduction among those of its stage.
  std::optional<int32_t> findReduction(mlir::StringAttr stage,
                                       mlir::StringAttr state,
                                       mlir::StringRef field) const;
  /// The number of a selection among those of its stage.
  std::optional<int32_t> findSelection(mlir::StringAttr stage,
                                       mlir::StringAttr unitImage) const;

private:
  void numberStates();
};

/// Data and extent of a piece of state, loaded when a kernel starts; of private
/// images the data is loaded when a unit starts, and of tiles data and pitch
/// when a bin does.
struct StateView {
  mlir::Value data;
  llvm::SmallVector<mlir::Value> extents; // i64
  mlir::Value pitch; ///< Elements from one row to the next: i64.

  /// Elements from one index of a dimension to the next one.
  mlir::Value getFactor(size_t dim) const {
    return dim == 0 ? pitch : extents[dim];
  }
};

/// What the threads of a grid leave their emissions in.
struct GridContext {
  mlir::Value log;     ///< pikoir_log *
  mlir::Value buffers; ///< A thread's, PIKOIR_APPEND_WORDS each.
  mlir::Value kept;    ///< The block's, PIKOIR_LOCAL_WORDS for a local edge.
  /// Stage (-1 is the kernel's) and port of each local edge, and the size of
  /// its records.
  llvm::SmallVector<std::pair<int64_t, int64_t>> locals;
  llvm::SmallVector<int64_t> recordBytes;
  llvm::SmallVector<bool> placed; ///< Whether records are kept by placing them.
  bool forErrors =
      false; ///< An append buffer's words are in the log, from an error on.
};

class LoweringContext {
public:
  explicit LoweringContext(mlir::ModuleOp module)
      : tags(module.getContext()), module(module) {}

  /// Makes a function of a kernel: pipeline in, status out. The function's body
  /// is the kernel's.
  mlir::func::FuncOp outline(KernelOp kernel, const PipelineNumbers &numbers);

  /// The numbers that go with the function around an operation.
  const PipelineNumbers &numbers(mlir::Operation *op) const;
  int32_t stageNumber(mlir::Operation *op, mlir::StringRef stage) const;
  StageOp stage(mlir::Operation *op, mlir::FlatSymbolRefAttr name) const;
  /// The stage over whose bins the kernel around an operation runs; an error if
  /// there is none.
  mlir::FailureOr<mlir::StringAttr> kernelStage(mlir::Operation *op) const;
  mlir::Operation *state(mlir::Operation *op, mlir::StringRef name) const;
  RecordOp record(mlir::FlatSymbolRefAttr name) const;

  /// The runtime's pipeline in the function around an operation.
  mlir::Value frame(mlir::Operation *op) const;
  StateView &view(mlir::OpBuilder &builder, mlir::Operation *op,
                  mlir::StringRef state);
  /// Lets all access to an image in the function around an operation go to
  /// other data; an internal one is as large as `like`.
  void setData(mlir::OpBuilder &builder, mlir::Operation *op,
               mlir::StringRef image, mlir::StringRef like, mlir::Value data);
  /// Lets it go to a bin's pixels, with another pitch.
  void setTile(mlir::Operation *op, mlir::StringRef image, mlir::Value data,
               mlir::Value pitch);
  /// The image itself, of which bins before may have had tiles.
  const StateView &whole(mlir::OpBuilder &builder, mlir::Operation *op,
                         mlir::StringRef image);
  /// How many primitives a bin must have that a copy of its pixels pays (i64):
  /// asked once, where the kernel around an operation begins.
  mlir::Value tileLeast(mlir::OpBuilder &builder, mlir::Operation *op,
                        int32_t stage, int32_t image);
  /// Entry `dim` (i64) of what one of the runtime's queries (the domain, or the
  /// grid of a stage) points to.
  mlir::Value query(mlir::OpBuilder &builder, mlir::Operation *op,
                    const RuntimeFunction &function,
                    std::optional<int32_t> stage, int64_t dim);

  /// A member of the pikoir_input that a kernel was given, loaded where it is
  /// given: a grid of blocks gets it as an argument.
  mlir::Value member(mlir::OpBuilder &builder, mlir::Value bins,
                     const RuntimeMember &which);

  /// Calls a function of the runtime, declared on first use.
  mlir::LLVM::CallOp call(mlir::OpBuilder &builder, mlir::Location loc,
                          const RuntimeFunction &function,
                          mlir::ValueRange arguments);
  /// Whether a number of 32 bits that it gives is not 0.
  mlir::Value test(mlir::OpBuilder &builder, mlir::Location loc,
                   const RuntimeFunction &function, mlir::ValueRange arguments);

  /// The function of that name and type, which does nothing but compute.
  /// Declared on first use.
  mlir::LLVM::LLVMFuncOp pureFunction(mlir::OpBuilder &builder,
                                      mlir::StringRef name,
                                      mlir::LLVM::LLVMFunctionType type);

  /// The name of a constant of at least so many zero bytes.
  mlir::StringRef zeros(int64_t bytes);

  /// The address of constant numbers.
  mlir::Value array(mlir::OpBuilder &builder, mlir::Location loc,
                    llvm::ArrayRef<int32_t> numbers);
  /// The address of a constant text.
  mlir::Value text(mlir::OpBuilder &builder, mlir::Location loc,
                   mlir::StringRef text);

  /// "file:line" of an operation, or null where that is not known.
  mlir::Value place(mlir::OpBuilder &builder, mlir::Operation *op);

  /// The grid that an operation is in, or null on a CPU.
  GridContext *grid(mlir::Operation *op);
  void noteGrid(mlir::Operation *inside, GridContext grid);
  /// The number of another place that can fail, of all launches of a kernel.
  int32_t nextPlace(mlir::Operation *launch);

  const AliasTags tags;

private:
  mlir::ModuleOp module;
  llvm::StringMap<mlir::LLVM::GlobalOp> texts;
  int64_t arrayCount = 0;
  llvm::StringMap<mlir::LLVM::LLVMFuncOp> called; // the runtime's
  llvm::DenseMap<mlir::Operation *, const PipelineNumbers *> functions;
  llvm::DenseMap<mlir::Operation *, GridContext> grids; // by launch
  llvm::DenseMap<mlir::Operation *, int32_t> places;    // by function
  /// By function and name.
  llvm::DenseMap<mlir::Operation *, llvm::StringMap<StateView>> views, wholes;
  llvm::DenseMap<mlir::Operation *, llvm::StringMap<mlir::Value>> queries;
  llvm::DenseMap<std::tuple<mlir::Value, mlir::Operation *, int64_t>,
                 mlir::Value>
      members;
};

/// A pattern that uses it.
template <typename OpT> struct ContextPattern : mlir::OpConversionPattern<OpT> {
  ContextPattern(const mlir::TypeConverter &converter, mlir::MLIRContext *mlir,
                 LoweringContext &context)
      : mlir::OpConversionPattern<OpT>(converter, mlir), context(context) {}

  LoweringContext &context;
};

/// A load or a store with a tag that says what it touches.
mlir::Value createLoad(mlir::OpBuilder &builder, mlir::Location loc,
                       mlir::Type type, mlir::Value address,
                       mlir::ArrayAttr tag);
void createStore(mlir::OpBuilder &builder, mlir::Location loc,
                 mlir::Value value, mlir::Value address, mlir::ArrayAttr tag);
/// Constants and casts.
mlir::Value createI32(mlir::OpBuilder &builder, mlir::Location loc, int64_t v);
mlir::Value createI64(mlir::OpBuilder &builder, mlir::Location loc, int64_t v);
/// An index, i32 or i64 as i64; signed.
mlir::Value toI64(mlir::OpBuilder &builder, mlir::Location loc, mlir::Value v);
mlir::Value toIndex(mlir::OpBuilder &builder, mlir::Location loc,
                    mlir::Value v);
/// A pointer so many bytes after another.
mlir::Value createOffset(mlir::OpBuilder &builder, mlir::Location loc,
                         mlir::Value pointer, int64_t bytes);
mlir::Value createOffset(mlir::OpBuilder &builder, mlir::Location loc,
                         mlir::Value pointer, mlir::Value bytes);
/// Asks for so many bytes, of many the first lines of the cache and the last;
/// the pointer may lead anywhere.
void createPrefetch(mlir::OpBuilder &builder, mlir::Location loc,
                    mlir::Value pointer, int64_t bytes);
/// The address of an element of a field of a record.
mlir::Value createFieldAddress(mlir::OpBuilder &builder, mlir::Location loc,
                               mlir::Value record, FieldAttr field,
                               mlir::ValueRange elements);

/// So many bytes (i64) at a pointer, as a memref.
mlir::Value createBytes(mlir::OpBuilder &builder, mlir::Location loc,
                        mlir::Value pointer, mlir::Value size,
                        mlir::MemRefType type);

/// Declares what kernels reduce to private copies of, and makes the functions
/// that combine these.
void declareReductions(mlir::OpBuilder &builder, mlir::Value frame,
                       const PipelineNumbers &numbers,
                       LoweringContext &context);
/// The same of what kernels select pixels of.
void declareSelections(mlir::OpBuilder &builder, mlir::Value frame,
                       const PipelineNumbers &numbers,
                       LoweringContext &context);
mlir::LLVM::AtomicBinOp toAtomicBinOp(AtomicKind kind);
/// What an atomic operation on integers, or on vectors of them, makes of what
/// was there.
mlir::Value createChange(mlir::OpBuilder &builder, mlir::Location loc,
                         AtomicKind kind, mlir::Value old, mlir::Value value);
/// A private copy keeps one note of whether it has been changed for 1 << so
/// many records.
int64_t getRunShift(RecordOp record);

/// Patterns for the storage of bins, for writers, for emissions of lanes, for
/// state, for checking mode, for approximations, for private copies and images,
/// and for the logs of grids.
void populateKernelToLLVMPatterns(const mlir::TypeConverter &converter,
                                  mlir::RewritePatternSet &patterns,
                                  LoweringContext &context);
void populateWriterToLLVMPatterns(const mlir::TypeConverter &converter,
                                  mlir::RewritePatternSet &patterns,
                                  LoweringContext &context);
void populateEmissionsToLLVMPatterns(const mlir::TypeConverter &converter,
                                     mlir::RewritePatternSet &patterns,
                                     LoweringContext &context);
void populateStateToLLVMPatterns(const mlir::TypeConverter &converter,
                                 mlir::RewritePatternSet &patterns,
                                 LoweringContext &context);
void populateRecordsToLLVMPatterns(const mlir::TypeConverter &converter,
                                   mlir::RewritePatternSet &patterns,
                                   LoweringContext &context);
void populateRunsToLLVMPatterns(const mlir::TypeConverter &converter,
                                mlir::RewritePatternSet &patterns,
                                LoweringContext &context);
void populateLanesToLLVMPatterns(const mlir::TypeConverter &converter,
                                 mlir::RewritePatternSet &patterns,
                                 LoweringContext &context);
void populateCountsToLLVMPatterns(const mlir::TypeConverter &converter,
                                  mlir::RewritePatternSet &patterns,
                                  LoweringContext &context);
void populateChecksToLLVMPatterns(const mlir::TypeConverter &converter,
                                  mlir::RewritePatternSet &patterns,
                                  LoweringContext &context);

void populateApproximationsToLLVMPatterns(const mlir::TypeConverter &converter,
                                          mlir::RewritePatternSet &patterns,
                                          LoweringContext &context);
void populateRowReductionsToLLVMPatterns(const mlir::TypeConverter &converter,
                                         mlir::RewritePatternSet &patterns,
                                         LoweringContext &context);
void populateReductionsToLLVMPatterns(const mlir::TypeConverter &converter,
                                      mlir::RewritePatternSet &patterns,
                                      LoweringContext &context);
void populateTilesToLLVMPatterns(const mlir::TypeConverter &converter,
                                 mlir::RewritePatternSet &patterns,
                                 LoweringContext &context);
void populateSelectionsToLLVMPatterns(const mlir::TypeConverter &converter,
                                      mlir::RewritePatternSet &patterns,
                                      LoweringContext &context);
void populateGridToLLVMPatterns(const mlir::TypeConverter &converter,
                                mlir::RewritePatternSet &patterns,
                                LoweringContext &context);

/// Makes branches of casts from float to integer that saturate.
void branchInSaturatingCasts(mlir::func::FuncOp function);

/// Lets a kernel for which there is one thread run its units without a parallel
/// region, as calls of a function.
void outlineUnits(mlir::func::FuncOp kernel);
/// Makes functions of the versions of loops over primitives (`piko.versions`)
/// whose scalar version is one of two itself.
void outlineVersions(mlir::func::FuncOp kernel);

/// The name of a kernel's function.
std::string getFunctionName(KernelOp kernel);

/// Writes NAME.setup and NAME.run, from a program whose kernels are not yet
/// functions; returns the first.
mlir::func::FuncOp createProgram(const PipelineNumbers &numbers,
                                 LoweringContext &context);

} // namespace piko

#endif // PIKO_LIB_CONVERSION_PIKOTOLLVM_LOWERINGCONTEXT_H
