// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the cache calls an object.

#include "ObjectRequest.h"

#include "Cache/SourceCache.h"
#include "Piko/Driver/Compiler.h"
#include "Piko/Target/Assembler.h"

using namespace piko;

std::string piko::makeObjectRequest(const ObjectOptions &options,
                                    llvm::ArrayRef<Processor> processors,
                                    llvm::vfs::FileSystem &files,
                                    CompilerPart part) {
  KeyBuilder key;
  addSurroundings(key, part);
  addFolder(key, files);
  const CompileOptions &source = options.source;
  key.add(source.file).add(source.pipeName).add(source.text.value_or(""));
  for (const auto *list :
       {&source.includeDirs, &source.defines, &source.check.numbers,
        &source.synthesis.without, &source.synthesis.fix,
        &source.synthesis.directives}) {
    key.add(std::to_string(list->size()));
    for (const std::string &item : *list)
      key.add(item);
  }
  key.add(std::to_string(source.tunables.size()));
  for (const auto &[name, value] : source.tunables)
    key.add(name).add(value);
  key.add(std::to_string(processors.size()));
  for (const Processor &processor : processors)
    key.add(processor.name).add(processor.features);
  for (int number :
       {int(source.text.has_value()), int(source.check.enabled),
        options.target.optLevel, int(options.target.sanitizer),
        int(options.remarks), int(source.gpu.target),
        int(source.synthesis.count), int(100 * source.synthesis.mappingWindow),
        int(source.synthesis.ranks), int(source.gpu.seed),
        int(source.gpu.blocks), int(source.gpu.threads)})
    key.add(std::to_string(number));
  key.add(options.target.arch)
      .add(source.gpu.chip)
      .add(options.nameSpace)
      .add(getRuntimeIncludeDir());
  for (const std::string &chip : source.gpu.cubins)
    key.add(chip);
  if (!source.gpu.cubins.empty())
    key.add(getAssemblerIdentity(findAssembler()));
  return key.finish();
}
