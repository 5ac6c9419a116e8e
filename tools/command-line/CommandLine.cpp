//===- CommandLine.cpp - Command lines of tools ---------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/CommandLine/CommandLine.h"

#include <algorithm>
#include <sstream>

using namespace piko;

namespace {

/// The help as all tools of Piko's write it.
class Formatter : public CLI::Formatter {
public:
  explicit Formatter(std::string usage) : usage(std::move(usage)) {
    column_width(25);
  }

  std::string make_usage(const CLI::App *, std::string) const override {
    return "\nusage: " + usage + "\n";
  }
  std::string make_option_opts(const CLI::Option *option) const override {
    const std::string &value = option->get_option_text();
    return value.empty() || value.starts_with('[') ? value : " " + value;
  }
  std::string make_option_desc(const CLI::Option *option) const override {
    return wrap(option->get_description(), 80 - get_column_width());
  }
  std::string make_description(const CLI::App *app) const override {
    return wrap(app->get_description(), 80) + "\n";
  }

private:
  static std::string wrap(const std::string &text, size_t width) {
    std::string lines;
    size_t column = 0;
    std::istringstream words(text);
    for (std::string word; words >> word; column += word.size()) {
      bool fits = column + 1 + word.size() <= width;
      if (!lines.empty())
        lines += fits ? ' ' : '\n';
      column = fits ? column + !lines.empty() : 0;
      lines += word;
    }
    return lines;
  }

  std::string usage;
};

} // namespace

CommandLine::CommandLine(const std::string &usage,
                         const std::string &description)
    : App(description) {
  formatter(std::make_shared<Formatter>(usage));
  set_help_flag("-h,--help", "print this");
  allow_extras();
  beginGroup("Options");
}

void CommandLine::beginGroup(const std::string &name) {
  option_defaults()->group(name);
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

support::Result<std::string> CommandLine::read(Words words) {
  std::reverse(words.begin(), words.end()); // as CLI11 takes them
  try {
    parse(std::move(words));
  } catch (const CLI::CallForHelp &) {
    return help();
  } catch (const CLI::ArgumentMismatch &error) {
    std::string message = error.what();
    return support::Error{"option '" + message.substr(0, message.find(':')) +
                          "' lacks its value"};
  } catch (const CLI::ParseError &error) {
    return support::Error{error.what()};
  }
  if (Words extras = remaining(); !extras.empty())
    return support::Error{(extras[0].size() > 1 && extras[0][0] == '-'
                               ? "unknown option '"
                               : "unexpected argument '") +
                          extras[0] + "'"};
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
