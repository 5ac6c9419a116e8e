// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What piko-tune chose, as JSON.

#include "Piko/Driver/TunedSetting.h"

#include "llvm/ADT/SmallString.h"
#include "llvm/Support/FileSystem.h"
#include "llvm/Support/Format.h"
#include "llvm/Support/JSON.h"
#include "llvm/Support/MemoryBuffer.h"
#include "llvm/Support/Path.h"
#include "llvm/Support/raw_ostream.h"

using namespace piko;
namespace json = llvm::json;

//===----------------------------------------------------------------------===//
// Reading
//===----------------------------------------------------------------------===//

namespace {

/// Takes the members of the file's object one by one; the first problem is
/// kept.
class Reader {
public:
  TunedSetting read(const json::Object &object) {
    for (const auto &[key, value] : object)
      readMember(key, value);
    if (problem.empty() && setting.pipeline.empty())
      problem = "expected \"pipeline\", the name of the pipeline that is tuned";
    return setting;
  }

  std::string problem;

private:
  void readMember(llvm::StringRef key, const json::Value &value);
  void readTunables(const json::Value &value);
  void readDirectives(const json::Value &value);
  void readWithout(const json::Value &value);
  void expect(llvm::StringRef what, llvm::StringRef where) {
    if (problem.empty())
      problem = ("expected " + what + " for \"" + where + "\"").str();
  }

  TunedSetting setting;
};

} // namespace

/// The text of a tunable's value; empty if it is no number, truth or name.
static std::string readValue(const json::Value &value) {
  if (auto truth = value.getAsBoolean())
    return *truth ? "true" : "false";
  if (auto number = value.getAsInteger())
    return std::to_string(*number);
  if (auto number = value.getAsUINT64())
    return std::to_string(*number);
  std::string text;
  llvm::raw_string_ostream stream(text);
  if (auto number = value.getAsNumber())
    stream << llvm::format("%.9g", *number);
  else if (auto name = value.getAsString())
    stream << *name;
  return text;
}

void Reader::readMember(llvm::StringRef key, const json::Value &value) {
  if (key == "pipeline") {
    if (auto name = value.getAsString())
      setting.pipeline = name->str();
    else
      expect("a string", key);
  } else if (key == "tunables") {
    readTunables(value);
  } else if (key == "directives") {
    readDirectives(value);
  } else if (key == "without") {
    readWithout(value);
  } else if (key == "strip") {
    auto size = value.getAsInteger();
    if (size && *size >= 0)
      setting.stripSize = *size;
    else
      expect("a number of primitives", key);
  } else if (key == "mappings") {
    if (auto text = value.getAsString())
      setting.mappings = text->str();
    else
      expect("a string", key);
  } else if (key != "measured" && problem.empty()) {
    problem = ("expected pipeline, tunables, directives, without, strip, "
               "mappings or measured, but got \"" +
               key + "\"")
                  .str();
  }
}

void Reader::readTunables(const json::Value &value) {
  const json::Object *members = value.getAsObject();
  if (!members)
    return expect("an object", "tunables");
  for (const auto &[name, member] : *members) {
    std::string text = readValue(member);
    if (text.empty())
      expect("a number, a truth value or an enumerator", name);
    setting.tunables.emplace_back(name.str(), text);
  }
  llvm::sort(setting.tunables);
}

void Reader::readDirectives(const json::Value &value) {
  const json::Object *stages = value.getAsObject();
  if (!stages)
    return expect("an object", "directives");
  for (const auto &[stage, directives] : *stages) {
    const json::Object *members = directives.getAsObject();
    if (!members)
      return expect("an object", stage);
    for (const auto &[key, member] : *members) {
      std::string text = readValue(member);
      if (text.empty())
        expect("a number or a name", key);
      setting.directives.push_back(stage.str() + ":" + key.str() + "=" + text);
    }
  }
  // So schedule comes before split.
  llvm::sort(setting.directives);
}

void Reader::readWithout(const json::Value &value) {
  const json::Array *names = value.getAsArray();
  if (!names)
    return expect("an array", "without");
  for (const json::Value &name : *names) {
    auto text = name.getAsString();
    auto options = text ? parseSynthesisOptions(text->str()) : std::nullopt;
    if (!options || options->without.size() != 1)
      return expect("names of passes that can be left out", "without");
    setting.without.push_back(options->without.front());
  }
}

/// "[3:5, byte=20]: Expected x" of LLVM as "line 3, column 5: expected x".
static std::string describeParseError(llvm::Error error) {
  std::string text = llvm::toString(std::move(error));
  auto [place, message] = llvm::StringRef(text).split("]: ");
  auto [line, column] = place.drop_front().split(',').first.split(':');
  if (message.empty())
    return text;
  return ("line " + line + ", column " + column + ": " +
          message.take_front().lower() + message.drop_front())
      .str();
}

/// Where a relative path was looked for.
static std::string describeFolder(const std::string &path) {
  llvm::SmallString<128> folder;
  if (llvm::sys::path::is_absolute(path) || llvm::sys::fs::current_path(folder))
    return "";
  return (" in folder '" + folder + "'").str();
}

std::optional<TunedSetting> piko::readTunedSetting(const std::string &path,
                                                   std::string &error) {
  auto fail = [&](const std::string &why) {
    error = "tuned file '" + path + "': " + why;
    return std::nullopt;
  };
  auto buffer = llvm::MemoryBuffer::getFile(path);
  if (!buffer)
    return fail(buffer.getError().message() + describeFolder(path));
  llvm::Expected<json::Value> value = json::parse((*buffer)->getBuffer());
  if (!value)
    return fail(describeParseError(value.takeError()));
  const json::Object *object = value->getAsObject();
  if (!object)
    return fail("expected a JSON object");
  Reader reader;
  TunedSetting setting = reader.read(*object);
  if (!reader.problem.empty())
    return fail(reader.problem);
  return setting;
}

std::string TunedSetting::apply(std::string &pipeName, TunableSettings &values,
                                SynthesisOptions &synthesis) const {
  if (pipeName.empty())
    pipeName = pipeline;
  if (pipeName != pipeline)
    return "expected a setting of pipeline '" + pipeName +
           "', but the tuned file is about '" + pipeline + "'";
  values.insert(values.end(), tunables.begin(), tunables.end());
  synthesis.directives.insert(synthesis.directives.end(), directives.begin(),
                              directives.end());
  synthesis.without.insert(synthesis.without.end(), without.begin(),
                           without.end());
  return "";
}

//===----------------------------------------------------------------------===//
// Writing
//===----------------------------------------------------------------------===//

/// A number or a truth value, where the text is one; else a string.
static json::Value writeValue(const std::string &text) {
  if (llvm::Expected<json::Value> value = json::parse(text)) {
    if (value->kind() == json::Value::Number ||
        value->kind() == json::Value::Boolean)
      return std::move(*value);
  } else {
    llvm::consumeError(value.takeError());
  }
  return text;
}

static json::Object writeDirectives(llvm::ArrayRef<std::string> directives) {
  json::Object stages;
  for (llvm::StringRef directive : directives) {
    auto [stage, rest] = directive.split(':');
    auto [key, value] = rest.split('=');
    json::Value &members = stages[stage];
    if (!members.getAsObject())
      members = json::Object();
    (*members.getAsObject())[key] = writeValue(value.str());
  }
  return stages;
}

std::string piko::writeTunedSetting(const TunedSetting &setting,
                                    const std::string &measured) {
  std::string text;
  llvm::raw_string_ostream stream(text);
  json::OStream writer(stream, /*IndentSize=*/2);
  writer.object([&] {
    writer.attribute("pipeline", setting.pipeline);
    json::Object tunables;
    for (const auto &[name, value] : setting.tunables)
      tunables[name] = writeValue(value);
    writer.attribute("tunables", std::move(tunables));
    writer.attribute("directives", writeDirectives(setting.directives));
    writer.attribute("without", json::Array(setting.without));
    if (setting.stripSize > 0)
      writer.attribute("strip", setting.stripSize);
    if (!setting.mappings.empty())
      writer.attribute("mappings", setting.mappings);
    llvm::Expected<json::Value> record = json::parse(measured);
    if (record)
      writer.attribute("measured", std::move(*record));
    else
      llvm::consumeError(record.takeError());
  });
  stream << "\n";
  return text;
}
