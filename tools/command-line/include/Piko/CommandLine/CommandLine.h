//===- CommandLine.h - Command lines of tools -------------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// CLI11 with Piko's messages and help. Options are read in the order of the
// command line; of one that is given twice the last value counts, unless it
// keeps a list.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_COMMANDLINE_COMMANDLINE_H
#define PIKO_COMMANDLINE_COMMANDLINE_H

#include "Piko/CommandLine/Help.h"
#include "Piko/Support/Result.h"

#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace piko {

class CommandLine : public CLI::App {
public:
  using Words = std::vector<std::string>;
  /// Takes what follows an option; throws what wrong() returns.
  using Action = std::function<void(const std::string &)>;

  template <class T>
  static constexpr T lowest = std::numeric_limits<T>::lowest();
  template <class T> static constexpr T highest = std::numeric_limits<T>::max();

  /// `usage` is a line for each way to call the tool, whose name each begins
  /// with; of the description the first sentence says what it is.
  CommandLine(const std::string &usage, const std::string &description,
              const std::string &example = "");

  /// The heading in the help of the options that are added from here on.
  void beginGroup(const std::string &name);

  /// Puts an option into the help that fits a screen, in these few words.
  void setBrief(const std::string &name, const std::string &brief);

  /// `value` as the help shows it. A positional's name has no dashes.
  CLI::Option *addText(const std::string &name, const std::string &value,
                       Action action, const std::string &description);
  CLI::Option *addText(const std::string &name, const std::string &value,
                       std::string &text, const std::string &description);
  /// May be repeated.
  CLI::Option *addTexts(const std::string &name, const std::string &value,
                        Words &texts, const std::string &description);
  /// An option whose value, if it has one, is behind an equals sign, which
  /// `action` gets with it.
  CLI::Option *addOptional(const std::string &name, const std::string &value,
                           Action action, const std::string &description);

  /// An option that takes one of these words.
  CLI::Option *addChoice(const std::string &name, const std::string &value,
                         std::vector<Choice> choices, Action action,
                         const std::string &description);

  template <class T>
  CLI::Option *addNumber(const std::string &name, const std::string &value,
                         T &number, const std::string &description,
                         std::type_identity_t<T> least = lowest<T>,
                         std::type_identity_t<T> most = highest<T>) {
    return addText(
        name, value,
        [=, &number](const std::string &text) {
          number = readNumber(name, text, least, most);
        },
        description);
  }
  /// Of an option that as many words follow as `count` says, or one and more if
  /// it is 0.
  CLI::Option *addValues(const std::string &name, const std::string &value,
                         int count, std::function<void(const Words &)> action,
                         const std::string &description);
  template <class T>
  CLI::Option *addNumbers(const std::string &name, const std::string &value,
                          int count, std::vector<T> &numbers,
                          const std::string &description,
                          std::type_identity_t<T> least = lowest<T>,
                          std::type_identity_t<T> most = highest<T>) {
    return addValues(
        name, value, count,
        [=, &numbers](const Words &texts) {
          numbers.clear();
          for (const std::string &text : texts)
            numbers.push_back(readNumber<T>(name, text, least, most));
        },
        description);
  }

  /// The number that a text is, in any locale; throws what wrong() returns.
  template <class T>
  static T readNumber(const std::string &name, const std::string &text,
                      T least = lowest<T>, T most = highest<T>);

  /// What is wrong with the value of an option.
  static CLI::ValidationError wrong(const std::string &name,
                                    const std::string &message) {
    return CLI::ValidationError(name, message);
  }

  /// Reads all words. Returns what is asked for in place of the tool's work,
  /// the help or the version, or else nothing.
  support::Result<std::string> read(Words words);

  ToolHelp describe() const;

  /// The first option of the group on the command line; empty if there is none.
  std::string findOption(const std::string &group) const;

private:
  support::Error refuse(const std::string &word) const;

  ToolHelp tool; ///< without its options
  std::map<std::string, std::string> briefs;
  std::map<const CLI::Option *, std::vector<Choice>> choicesOf;
};

/// The parts of a text between commas; none may be empty.
std::vector<std::string> splitNames(const std::string &option,
                                    const std::string &text);

template <class T>
T CommandLine::readNumber(const std::string &name, const std::string &text,
                          T least, T most) {
  constexpr bool isWhole = std::numeric_limits<T>::is_integer;
  T number{};
  const char *end = text.data() + text.size();
  auto [after, problem] = std::from_chars(text.data(), end, number);
  if (problem != std::errc() || after != end)
    throw wrong(name, std::string("expected a ") + (isWhole ? "whole " : "") +
                          "number, but got '" + text + "'");
  if constexpr (!isWhole)
    if (!std::isfinite(number))
      throw wrong(name, "expected a finite number");
  auto print = [](T bound) { return CLI::detail::to_string(bound); };
  if (number < least || number > most)
    throw wrong(name, most == highest<T>
                          ? "expected a number of at least " + print(least) +
                                ", but got " + text
                          : "expected a number from " + print(least) + " to " +
                                print(most) + ", but got " + text);
  return number;
}

} // namespace piko

#endif // PIKO_COMMANDLINE_COMMANDLINE_H
