// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What is said of a case that several targets run.

#ifndef PIKO_TEST_TOOLS_PIKO_COMPARE_REPORT_H
#define PIKO_TEST_TOOLS_PIKO_COMPARE_REPORT_H

#include <string>
#include <utility>
#include <vector>

/// Lines, each with the targets that it is true of. Where there is only one target,
/// it needs no name.
class Report {
public:
  void add(const std::string &target, const std::string &line);
  /// Each line once, in the order in which they came, after the names of its
  /// targets.
  void print() const;

private:
  std::vector<std::pair<std::string, std::vector<std::string>>> lines;
};

/// "a, b, c".
std::string joinNames(const std::vector<std::string> &names);

#endif // PIKO_TEST_TOOLS_PIKO_COMPARE_REPORT_H
