//===- CommandLine.cpp - Command lines of tools ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/CommandLine.h"

#include <algorithm>
#include <iterator>

using namespace piko;

CommandLine::CommandLine(const std::string &usage,
                         const std::string &description,
                         const std::string &example)
    : App(description), tool{usage, description, example, {}} {
  beginGroup("Options");
  set_help_flag("-h,--help", "print what fits a screen");
  set_help_all_flag("--help-all", "print this");
  set_version_flag("--version", printVersion(tool.getName()),
                   "print the version");
  add_flag_callback("--help-json", [this] {
    throw CLI::CallForVersion(printHelpAsJson(describe()), 0);
  })->group("");
  allow_extras();
}

void CommandLine::beginGroup(const std::string &name) {
  option_defaults()->group(name);
}

void CommandLine::setBrief(const std::string &name, const std::string &brief) {
  briefs[name] = brief;
}

CLI::Option *CommandLine::addValues(const std::string &name,
                                    const std::string &value, int count,
                                    std::function<void(const Words &)> action,
                                    const std::string &description) {
  CLI::Option *option = add_option(
      name,
      [action](const Words &words) {
        action(words);
        return true;
      },
      description);
  if (count == 0)
    option->expected(-1);
  else
    option->type_size(count);
  return option->option_text(value)->trigger_on_parse()->multi_option_policy(
      CLI::MultiOptionPolicy::TakeAll);
}

CLI::Option *CommandLine::addText(const std::string &name,
                                  const std::string &value, Action action,
                                  const std::string &description) {
  return addValues(
      name, value, 1, [action](const Words &words) { action(words[0]); },
      description);
}

CLI::Option *CommandLine::addText(const std::string &name,
                                  const std::string &value, std::string &text,
                                  const std::string &description) {
  return addText(
      name, value, [&text](const std::string &word) { text = word; },
      description);
}

CLI::Option *CommandLine::addTexts(const std::string &name,
                                   const std::string &value, Words &texts,
                                   const std::string &description) {
  return addText(
      name, value, [&texts](const std::string &word) { texts.push_back(word); },
      description);
}

CLI::Option *CommandLine::addOptional(const std::string &name,
                                      const std::string &value, Action action,
                                      const std::string &description) {
  // CLI11 gives an option that takes no word of its own "true" for nothing.
  return addText(
             name, value,
             [action](const std::string &word) {
               action(word == "true" ? "" : "=" + word);
             },
             description)
      ->type_size(0)
      ->expected(0);
}

CLI::Option *CommandLine::addChoice(const std::string &name,
                                    const std::string &value,
                                    std::vector<Choice> choices, Action action,
                                    const std::string &description) {
  auto take = [=](const std::string &word) {
    std::string words;
    for (const Choice &choice : choices) {
      if (choice.word == word)
        return action(word);
      words += (&choice == &choices[0]       ? ""
                : &choice == &choices.back() ? " or "
                                             : ", ") +
               choice.word;
    }
    throw wrong(name, "expected " + words + ", but got '" + word + "'");
  };
  CLI::Option *option = addText(name, value, take, description);
  choicesOf[option] = std::move(choices);
  return option;
}

ToolHelp CommandLine::describe() const {
  ToolHelp result = tool;
  for (const CLI::Option *option :
       get_options([](const CLI::Option *it) { return true; })) {
    if (option->get_group().empty())
      continue;
    OptionHelp help;
    for (const std::string &name : option->get_snames())
      help.names.push_back("-" + name);
    for (const std::string &name : option->get_lnames())
      help.names.push_back("--" + name);
    help.isPositional = option->get_positional();
    if (help.isPositional)
      help.names.push_back(option->get_name(true));
    help.value = option->get_option_text();
    help.takesValue = help.isPositional || !help.value.empty();
    help.description = option->get_description();
    help.group = help.isPositional ? "Arguments" : option->get_group();
    for (const std::string &name : help.names)
      if (auto brief = briefs.find(name); brief != briefs.end())
        help.brief = brief->second;
    if (auto choices = choicesOf.find(option); choices != choicesOf.end())
      help.choices = choices->second;
    result.options.push_back(std::move(help));
  }
  // What is asked for in place of the tool's work comes last.
  auto rank = [](const OptionHelp &option) {
    const std::string &name = option.names.back();
    bool isAsked = name.starts_with("--help") || name == "--version";
    return option.isPositional ? 0 : isAsked ? 2 : 1;
  };
  std::vector<OptionHelp> ordered;
  for (int i = 0; i < 3; ++i)
    std::copy_if(result.options.begin(), result.options.end(),
                 std::back_inserter(ordered),
                 [&](const OptionHelp &it) { return rank(it) == i; });
  result.options = std::move(ordered);
  return result;
}

support::Error CommandLine::refuse(const std::string &word) const {
  bool isOption = word.size() > 1 && word[0] == '-';
  if (!isOption)
    return support::Error{"unexpected argument '" + word + "'"};
  std::vector<std::string> names;
  for (const OptionHelp &option : describe().options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  std::string nearest = findNearest(word.substr(0, word.find('=')), names);
  return support::Error{
      "unknown option '" + word + "'; " +
      (nearest.empty() ? "see --help" : "did you mean '" + nearest + "'?")};
}

support::Result<std::string> CommandLine::read(Words words) {
  std::reverse(words.begin(), words.end()); // as CLI11 takes them
  try {
    parse(std::move(words));
  } catch (const CLI::CallForHelp &) {
    return printShortHelp(describe());
  } catch (const CLI::CallForAllHelp &) {
    return printLongHelp(describe());
  } catch (const CLI::CallForVersion &asked) {
    return std::string(asked.what());
  } catch (const CLI::ArgumentMismatch &error) {
    std::string message = error.what();
    return support::Error{"option '" + message.substr(0, message.find(':')) +
                          "' lacks its value"};
  } catch (const CLI::ParseError &error) {
    return support::Error{error.what()};
  }
  if (Words extras = remaining(); !extras.empty())
    return refuse(extras[0]);
  return std::string();
}

std::string CommandLine::findOption(const std::string &group) const {
  for (const CLI::Option *option : parse_order())
    if (option->get_group() == group)
      return option->get_name();
  return {};
}

std::vector<std::string> piko::splitNames(const std::string &option,
                                          const std::string &text) {
  std::vector<std::string> names;
  for (size_t begin = 0; begin <= text.size();) {
    size_t end = std::min(text.find(',', begin), text.size());
    if (end == begin)
      throw CommandLine::wrong(
          option,
          "expected names with commas between them, but got '" + text + "'");
    names.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}
