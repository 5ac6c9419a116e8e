//===- Help.cpp - What tools say of themselves ----------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/Help.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <string_view>

using namespace piko;

namespace {

constexpr size_t lineWidth = 80, columnWidth = 25;

/// Lines of at most `width`, those after the first behind `indent` spaces.
std::string wrap(const std::string &text, size_t width, size_t indent = 0) {
  std::string lines;
  size_t column = 0;
  std::istringstream words(text);
  for (std::string word; words >> word; column += word.size()) {
    bool fits = column + 1 + word.size() <= width;
    if (!lines.empty())
      lines += fits ? " " : "\n" + std::string(indent, ' ');
    column = fits ? column + !lines.empty() : 0;
    lines += word;
  }
  return lines;
}

std::string indentLines(const std::string &text, const std::string &by) {
  std::string lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line); lines += line)
    lines += lines.empty() ? "" : "\n" + by;
  return lines;
}

std::string printUsage(const ToolHelp &tool) {
  std::string text = "usage: " + indentLines(tool.usage, "       ") + "\n";
  if (!tool.example.empty())
    text += "example: " + indentLines(tool.example, "         ") + "\n";
  return text;
}

/// "  -h,--help VALUE    "
std::string printNames(const OptionHelp &option) {
  std::string names = "  ";
  for (const std::string &name : option.names)
    names += (&name == &option.names[0] ? "" : ",") + name;
  if (!option.value.empty())
    names += (option.value[0] == '[' ? "" : " ") + option.value;
  if (names.size() + 1 > columnWidth)
    return names + "\n" + std::string(columnWidth, ' ');
  return names + std::string(columnWidth - names.size(), ' ');
}

std::string printOption(const OptionHelp &option) {
  constexpr size_t width = lineWidth - columnWidth;
  std::string text =
      printNames(option) + wrap(option.description, width, columnWidth) + "\n";
  for (const Choice &choice : option.choices)
    text += std::string(columnWidth, ' ') + "  " +
            wrap(choice.word + ": " + choice.description, width - 2,
                 columnWidth + 4) +
            "\n";
  return text;
}

} // namespace

std::string piko::printShortHelp(const ToolHelp &tool) {
  auto hasBrief = [](const OptionHelp &option) {
    return !option.brief.empty();
  };
  auto count =
      std::count_if(tool.options.begin(), tool.options.end(), hasBrief);
  if (count == 0)
    return printLongHelp(tool);
  std::string first = tool.description.substr(0, tool.description.find(". "));
  std::string text =
      wrap(first + (first.ends_with('.') ? "" : "."), lineWidth) + "\n\n" +
      printUsage(tool) + "\n";
  for (const OptionHelp &option : tool.options)
    if (hasBrief(option))
      text += printNames(option) + option.brief + "\n";
  text += "\n--help-all describes all options; so does 'man " + tool.getName() +
          "'.\n";
  return text;
}

std::string piko::printLongHelp(const ToolHelp &tool) {
  std::string text =
      wrap(tool.description, lineWidth) + "\n\n" + printUsage(tool);
  std::vector<std::string> groups;
  for (const OptionHelp &option : tool.options)
    if (std::find(groups.begin(), groups.end(), option.group) == groups.end())
      groups.push_back(option.group);
  for (const std::string &group : groups) {
    text += "\n" + group + ":\n";
    for (const OptionHelp &option : tool.options)
      if (option.group == group)
        text += printOption(option);
  }
  return text;
}

std::string piko::printHelpAsJson(const ToolHelp &tool) {
  using Json = nlohmann::ordered_json;
  Json options = Json::array();
  for (const OptionHelp &option : tool.options) {
    Json choices = Json::array();
    for (const Choice &choice : option.choices)
      choices.push_back(
          {{"word", choice.word}, {"description", choice.description}});
    options.push_back({{"names", option.names},
                       {"value", option.value},
                       {"description", option.description},
                       {"brief", option.brief},
                       {"group", option.group},
                       {"choices", choices},
                       {"takes_value", option.takesValue},
                       {"positional", option.isPositional}});
  }
  Json table = {{"name", tool.getName()},  {"version", PIKO_VERSION},
                {"usage", tool.usage},     {"description", tool.description},
                {"example", tool.example}, {"llvm", tool.isLLVMs},
                {"options", options}};
  return table.dump(1) + "\n";
}

std::string piko::printVersion(const std::string &name) {
  return name + " " + PIKO_VERSION + "\n";
}

bool piko::answerHelp(const ToolHelp &tool, int argc, char **argv) {
  static char all[] = "--help";
  for (int i = 1; i < argc; ++i) {
    std::string_view word = argv[i];
    std::string text;
    if (word == "--help" || word == "-help" || word == "-h")
      text = printShortHelp(tool);
    else if (word == "--help-json")
      text = printHelpAsJson(tool);
    else if (word == "--version" || word == "-version")
      text = printVersion(tool.getName());
    if (!text.empty()) {
      std::fputs(text.c_str(), stdout);
      return true;
    }
    if (word == "--help-all")
      argv[i] = all;
  }
  return false;
}

/// How many letters are wrong, too many, too few, or in another's place.
static size_t countEdits(const std::string &from, const std::string &to) {
  std::vector<std::vector<size_t>> edits(from.size() + 1,
                                         std::vector<size_t>(to.size() + 1));
  for (size_t i = 0; i <= from.size(); ++i)
    for (size_t k = 0; k <= to.size(); ++k) {
      if (i == 0 || k == 0) {
        edits[i][k] = i + k;
        continue;
      }
      edits[i][k] =
          std::min({edits[i - 1][k] + 1, edits[i][k - 1] + 1,
                    edits[i - 1][k - 1] + (from[i - 1] != to[k - 1])});
      if (i > 1 && k > 1 && from[i - 1] == to[k - 2] &&
          from[i - 2] == to[k - 1])
        edits[i][k] = std::min(edits[i][k], edits[i - 2][k - 2] + 1);
    }
  return edits[from.size()][to.size()];
}

std::string piko::findNearest(const std::string &word,
                              const std::vector<std::string> &names) {
  std::string nearest;
  // Of the letters of short words too few are left.
  size_t least = std::min<size_t>(3, word.size() / 4) + 1;
  for (const std::string &name : names)
    if (size_t edits = countEdits(word, name); edits < least) {
      least = edits;
      nearest = name;
    }
  return nearest;
}
