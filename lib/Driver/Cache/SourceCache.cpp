// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is made of text, on disk.

#include "Cache/SourceCache.h"

#include "llvm/Support/Endian.h"
#include "llvm/Support/Process.h"

using namespace llvm;
using namespace piko;

StringWriter &StringWriter::add(StringRef string) {
  char length[8];
  llvm::support::endian::write64le(length, string.size());
  bytes.append(length, 8).append(string.data(), string.size());
  return *this;
}

std::string StringReader::next() {
  if (bytes.size() < 8)
    return "";
  uint64_t length = llvm::support::endian::read64le(bytes.data());
  bytes = bytes.drop_front(8);
  std::string string = bytes.take_front(length).str();
  bytes = bytes.drop_front(string.size());
  return string;
}

void piko::addSurroundings(KeyBuilder &key, CompilerPart part) {
  key.add(getCompilerIdentity(part));
  // What Clang looks at besides its options.
  for (const char *name : {"CPATH", "CPLUS_INCLUDE_PATH", "SOURCE_DATE_EPOCH"})
    key.add(sys::Process::GetEnv(name).value_or(""));
}

void piko::addFolder(KeyBuilder &key, vfs::FileSystem &files) {
  if (auto folder = files.getCurrentWorkingDirectory())
    key.add(*folder);
}

std::unique_ptr<MemoryBuffer>
SourceCache::lookUp(StringRef request, vfs::FileSystem &files) const {
  std::unique_ptr<MemoryBuffer> questions = disk.read(request);
  if (!questions)
    return nullptr;
  KeyBuilder key;
  key.add(request);
  for (StringReader reader(questions->getBuffer()); !reader.atEnd();) {
    bool isRead = reader.next() == "read";
    SourceQuery query{reader.next(), isRead};
    key.add(query.path).add(answer(files, query));
  }
  return disk.read(key.finish());
}

Error SourceCache::keep(StringRef request, const SourceRecorder &recorder,
                        StringRef bytes) const {
  StringWriter questions;
  KeyBuilder key;
  key.add(request);
  for (const auto &[path, answer] : recorder.getAnswers()) {
    questions.add(answer.isRead ? "read" : "find").add(path);
    key.add(path).add(answer.text);
  }
  Error error = disk.write(key.finish(), bytes);
  if (!error)
    error = disk.write(request, questions.bytes);
  if (!error)
    disk.prune();
  return error;
}
