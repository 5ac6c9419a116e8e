// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Report.h"

#include <algorithm>
#include <cstdio>

std::string joinNames(const std::vector<std::string> &names) {
  std::string joined;
  for (const std::string &name : names)
    joined += (joined.empty() ? "" : ", ") + name;
  return joined;
}

void Report::add(const std::string &target, const std::string &line) {
  auto found = std::find_if(lines.begin(), lines.end(), [&](const auto &known) {
    return known.first == line;
  });
  if (found == lines.end())
    found = lines.insert(lines.end(), {line, {}});
  if (found->second.empty() || found->second.back() != target)
    found->second.push_back(target);
}

void Report::print() const {
  for (const auto &[line, targets] : lines) {
    std::string names = joinNames(targets);
    std::printf("%s%s%s\n", names.c_str(), names.empty() ? "" : ": ",
                line.c_str());
  }
}
