//===- Report.cpp - What piko-tune says and writes ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Report.h"

#include <cmath>
#include <filesystem>

using namespace piko;
using namespace piko::tune;
using render::Json;

static std::string print(const char *format, double number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

/// How a duel ended, for the first.
static std::string describe(const Duel &duel) {
  std::string text = "won " + std::to_string(duel.wins) + " of " +
                     std::to_string(duel.rounds) +
                     " rounds, p = " + print("%.2g", duel.chance());
  if (duel.rounds > 0 && duel.isLevel())
    text +=
        std::abs(duel.ratio - 1) < 0.01 ? ", level within 1 %" : ", not sure";
  return text;
}

static size_t countLeftOut(const TuneResult &result) {
  size_t count = 0;
  for (const Trial &trial : result.trials)
    count += !trial.problem.empty();
  return count;
}

std::string tune::summarize(const TuneResult &result) {
  const Outcome &outcome = result.outcome;
  const Space &space = result.space;
  const Trial &chosen = *outcome.chosen, &text = *outcome.text;
  std::string lines =
      space.name(chosen.setting) + ": " + print("%.3g ms", chosen.median());
  if (&chosen == &text)
    lines += ", as the text says\n";
  else
    lines += ", " + print("%.2f", outcome.againstText.ratio) +
             " times as fast as " + space.name(text.setting) + " (" +
             describe(outcome.againstText) + ")\n";
  lines += "error (" + result.options.metricName +
           "): " + print("%.3g", *chosen.error) + ", of " +
           result.options.errorText + "\n";
  if (outcome.runnerUp)
    lines += "runner-up: " + space.name(outcome.runnerUp->setting) + ", " +
             print("%.2f", outcome.againstRunnerUp.ratio) +
             " times the time (the chosen one " +
             describe(outcome.againstRunnerUp) + ")\n";
  lines += std::to_string(outcome.runs) + " runs of " +
           std::to_string(result.trials.size()) + " settings, " +
           std::to_string(outcome.compilations) + " compiled, " +
           std::to_string(countLeftOut(result)) + " left out" +
           (outcome.isBudgetSpent ? "; the budget is spent\n" : "\n");
  if (outcome.missedChanges > 0)
    lines += "the budget is too small for " +
             std::to_string(outcome.missedChanges) +
             " changes of one value; --budget " +
             std::to_string(outcome.neededBudget) + " is enough\n";
  for (const Trial &trial : result.trials)
    if (!trial.problem.empty())
      lines += "  left out: " + space.name(trial.setting) + ": " +
               trial.problem + "\n";
  if (const auto &survey = result.survey)
    lines += "all " + std::to_string(survey->settings) + " settings, " +
             std::to_string(survey->programs) + " programs, " +
             std::to_string(survey->runs) + " runs: the best is " +
             space.name(survey->best) + "; the chosen one is slower by " +
             print("%.1f %%", 100 * survey->regret) +
             print(" (%.1f", 100 * survey->leastRegret) +
             print(" to %.1f %%)\n", 100 * survey->mostRegret);
  return lines;
}

static Json describeJson(const Duel &duel) {
  return Json::object({{"wins", duel.wins},
                       {"rounds", duel.rounds},
                       {"p", duel.chance()},
                       {"ratio", render::roundToThousandths(duel.ratio)}});
}

/// Where and how was measured, and what.
static Json describeMeasurement(const TuneResult &result) {
  const render::Options &render = result.options.render;
  const Outcome &outcome = result.outcome;
  Json object = Json::object();
  object["scene"] = std::filesystem::path(render.scene).filename().string();
  object["width"] = result.size.x;
  object["height"] = result.size.y;
  if (!result.isCapture)
    object["lights"] = render.lights;
  object["threads"] = render.threads;
  object["processor"] = getProcessorName();
  object["clock"] = result.options.countsCPU ? "cpu" : "wall";
  object["metric"] = result.options.metricName;
  object["error_limit"] = result.options.error;
  object["error"] = *outcome.chosen->error;
  object["ms"] = render::roundToThousandths(outcome.chosen->median());
  object["text_ms"] = render::roundToThousandths(outcome.text->median());
  object["text"] = result.space.name(outcome.text->setting);
  object["against_text"] = describeJson(outcome.againstText);
  return object;
}

std::string tune::writeJson(const TuneResult &result) {
  const Outcome &outcome = result.outcome;
  Json object = Json::object();
  object["chosen"] = result.space.name(outcome.chosen->setting);
  object["changes"] = countChanges(outcome.chosen->setting);
  object["measured"] = describeMeasurement(result);
  if (outcome.runnerUp) {
    object["runner_up"] = result.space.name(outcome.runnerUp->setting);
    object["against_runner_up"] = describeJson(outcome.againstRunnerUp);
  }
  object["runs"] = outcome.runs;
  object["settings"] = result.trials.size();
  object["compilations"] = outcome.compilations;
  object["left_out"] = countLeftOut(result);
  object["budget_spent"] = int(outcome.isBudgetSpent);
  object["missed_changes"] = outcome.missedChanges;
  if (outcome.missedChanges > 0)
    object["needed_budget"] = outcome.neededBudget;
  object["summary"] = summarize(result);
  if (const auto &survey = result.survey) {
    object["all_settings"] = survey->settings;
    object["all_programs"] = survey->programs;
    object["all_runs"] = survey->runs;
    object["best"] = result.space.name(survey->best);
    object["regret"] = survey->regret;
    object["regret_least"] = survey->leastRegret;
    object["regret_most"] = survey->mostRegret;
  }
  return render::writeLine(object) + "\n";
}

/// A field of CSV.
static std::string quote(const std::string &text) {
  std::string quoted = "\"";
  for (char c : text)
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string tune::writeCSV(const TuneResult &result) {
  std::string text = "setting,ms,frames,error,problem\n";
  for (const Trial &trial : result.trials)
    text += quote(result.space.name(trial.setting)) + "," +
            (trial.times.empty() ? "" : print("%.6g", trial.median())) + "," +
            std::to_string(trial.times.size()) + "," +
            (trial.error ? print("%.9g", *trial.error) : "") + "," +
            quote(trial.problem) + "\n";
  if (!result.survey)
    return text;
  text += "\nof all settings,time by the text's,error,ms of rounds\n";
  for (const SurveyedSetting &one : result.survey->all) {
    text += quote(result.space.name(one.setting)) + print(",%.4f", one.ratio) +
            print(",%.9g", one.error);
    for (double time : one.times)
      text += print(",%.6g", time);
    text += "\n";
  }
  return text;
}

std::string tune::writeSetting(const TuneResult &result) {
  TunedSetting setting = result.space.describe(result.outcome.chosen->setting);
  const auto &without = result.options.render.load.synthesis.without;
  setting.without.insert(setting.without.end(), without.begin(), without.end());
  setting.mappings = result.mappings;
  return writeTunedSetting(setting,
                           render::writeLine(describeMeasurement(result)));
}
