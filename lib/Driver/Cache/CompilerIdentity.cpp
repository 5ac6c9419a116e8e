// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which compiler this is, from what its build says and from the notes that
// linkers leave in files.

#include "Cache/CompilerIdentity.h"

#include "llvm/ADT/StringExtras.h"
#include "llvm/Support/BLAKE3.h"
#include "llvm/Support/MathExtras.h"
#include "llvm/Support/MemoryBuffer.h"

#include <cstring>
#include <link.h>

using namespace llvm;
using namespace piko;

/// The build id in a segment of notes; empty if there is none.
static StringRef findBuildId(StringRef notes) {
  while (notes.size() >= sizeof(ElfW(Nhdr))) {
    ElfW(Nhdr) header;
    std::memcpy(&header, notes.data(), sizeof header);
    StringRef name =
        notes.drop_front(sizeof header).take_front(header.n_namesz);
    size_t begin = sizeof header + alignTo(header.n_namesz, 4);
    if (header.n_type == NT_GNU_BUILD_ID && name == StringRef("GNU\0", 4))
      return notes.substr(begin, header.n_descsz);
    notes = notes.drop_front(
        std::min(notes.size(), size_t(begin + alignTo(header.n_descsz, 4))));
  }
  return {};
}

static std::string identify(const dl_phdr_info &module) {
  for (const auto &segment : ArrayRef(module.dlpi_phdr, module.dlpi_phnum)) {
    if (segment.p_type != PT_NOTE)
      continue;
    StringRef notes(
        reinterpret_cast<const char *>(module.dlpi_addr + segment.p_vaddr),
        segment.p_memsz);
    if (StringRef id = findBuildId(notes); !id.empty())
      return toHex(id);
  }
  // A linker that was told to leave no id: the whole file tells.
  auto file = MemoryBuffer::getFile(module.dlpi_name, /*IsText=*/false,
                                    /*RequiresNullTerminator=*/false);
  if (!file)
    return "unknown";
  return toHex(BLAKE3::hash(arrayRefFromStringRef((*file)->getBuffer())));
}

namespace {
struct Identity {
  CompilerPart part;
  std::string text;
};
} // namespace

static int visit(dl_phdr_info *module, size_t, void *data) {
  auto &identity = *static_cast<Identity *>(data);
  StringRef name(module->dlpi_name);
  if (name.contains("/libLLVM") || name.contains("/libclang-cpp") ||
      (name.contains("/libMLIR") && identity.part != CompilerPart::Clang))
    identity.text += identify(*module) + ";";
  return 0;
}

std::string piko::getCompilerIdentity(CompilerPart part) {
  Identity identity{part, clangCalls};
  if (part == CompilerPart::Frontend)
    identity.text += frontendBuild;
  if (part == CompilerPart::All)
    identity.text += compilerBuild;
  dl_iterate_phdr(visit, &identity);
  return identity.text;
}
