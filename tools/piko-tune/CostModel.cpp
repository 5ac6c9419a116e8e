//===- CostModel.cpp - Times of settings that have not run ----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "CostModel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

using namespace piko;
using namespace piko::tune;

/// How unsure the mean of all settings is.
static constexpr double priorOfMean = 1;
/// Variance added to an observation that is not believed: it says nothing.
static constexpr double disbelief = 1;
/// By how many standard deviations an observation must be slower than what the
/// others let expect, not to be believed.
static constexpr double outlier = 3.5;
/// Rounds of what is believed, after all that ran.
static constexpr size_t firstOwnRound = size_t(1) << 40;

double CostModel::Prediction::expectImprovement(double below) const {
  if (deviation < 1e-9)
    return std::max(below - mean, 0.0);
  double z = (below - mean) / deviation;
  double density =
      std::exp(-z * z / 2) * std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  double probability = std::erfc(-z / std::numbers::sqrt2) / 2;
  return deviation * (z * probability + density);
}

CostModel::CostModel(size_t dimensions) {
  parameters.differences.assign(dimensions, 0.05);
  parameters.differences[0] = 0.4; // pipelines
}

double CostModel::compare(const Setting &a, const Setting &b) const {
  double alike = parameters.scale;
  for (size_t d = 0; d < a.size(); ++d)
    if (a[d] != b[d])
      alike *= 1 - parameters.differences[d];
  return alike;
}

double CostModel::covariance(size_t i, size_t j) const {
  const Observation &a = observations[i], &b = observations[j];
  double sum = priorOfMean + compare(a.setting, b.setting);
  if (a.round == b.round)
    sum += parameters.round;
  if (i == j)
    sum += parameters.noise + doubts[i];
  return sum;
}

void CostModel::append(size_t row) {
  std::vector<double> values(row + 1);
  for (size_t j = 0; j <= row; ++j) {
    double sum = covariance(row, j);
    const std::vector<double> &other = j == row ? values : lower[j];
    for (size_t k = 0; k < j; ++k)
      sum -= values[k] * other[k];
    values[j] = j == row ? std::sqrt(std::max(sum, 1e-12)) : sum / other[j];
  }
  lower.push_back(std::move(values));
}

std::vector<double> CostModel::solveLower(std::vector<double> values) const {
  for (size_t i = 0; i < values.size(); ++i) {
    for (size_t k = 0; k < i; ++k)
      values[i] -= lower[i][k] * values[k];
    values[i] /= lower[i][i];
  }
  return values;
}

std::vector<double> CostModel::solveUpper(std::vector<double> values) const {
  for (size_t i = values.size(); i-- > 0;) {
    values[i] /= lower[i][i];
    for (size_t k = 0; k < i; ++k)
      values[k] -= lower[i][k] * values[i];
  }
  return values;
}

void CostModel::solve() {
  std::vector<double> values;
  for (const Observation &observation : observations)
    values.push_back(observation.logTime - mean);
  weights = solveUpper(solveLower(std::move(values)));
}

double CostModel::factor() {
  lower.clear();
  double likelihood = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    append(i);
    likelihood -= std::log(lower[i][i]);
  }
  solve();
  for (size_t i = 0; i < observations.size(); ++i)
    likelihood -= weights[i] * (observations[i].logTime - mean) / 2;
  return likelihood;
}

/// A variance is expected to be within a factor of ten or so of `usual`.
static double penalize(double value, double usual) {
  double off = std::log(value / usual) / std::log(10.0);
  return off * off / 2;
}

/// Moves one parameter at a time to where what was observed is likeliest.
void CostModel::learn() {
  const Parameters usual = CostModel(parameters.differences.size()).parameters;
  auto rate = [&] {
    double sum = factor() - penalize(parameters.scale, usual.scale) -
                 penalize(parameters.noise, usual.noise) -
                 penalize(parameters.round, usual.round);
    for (size_t d = 0; d < usual.differences.size(); ++d)
      sum -= penalize(parameters.differences[d], usual.differences[d]);
    return sum;
  };
  struct Range {
    double *value, least, most;
  };
  std::vector<Range> ranges = {{&parameters.scale, 0.02, 2},
                               {&parameters.noise, 4e-6, 1e-2},
                               {&parameters.round, 1e-7, 1e-1}};
  for (double &difference : parameters.differences)
    ranges.push_back({&difference, 1e-3, 0.9});
  double best = rate();
  for (double step : {3.0, 3.0, 1.7}) {
    for (auto [value, least, most] : ranges)
      for (double by : {step, 1 / step})
        for (int i = 0; i < 2; ++i) {
          double before = *value;
          *value = std::clamp(before * by, least, most);
          double now = *value == before ? best : rate();
          if (now <= best) {
            *value = before;
            break;
          }
          best = now;
        }
  }
}

/// An element of the diagonal of the inverse.
double CostModel::findPrecision(size_t row) const {
  size_t count = observations.size();
  std::vector<double> unit(count, 0.0);
  unit[row] = 1;
  double precision = 0;
  for (size_t i = row; i < count; ++i) {
    for (size_t k = row; k < i; ++k)
      unit[i] -= lower[i][k] * unit[k];
    unit[i] /= lower[i][i];
    precision += unit[i] * unit[i];
  }
  return precision;
}

/// What the others let expect of an observation, for all of them, follows from
/// the diagonal of the inverse (leave-one-out).
void CostModel::doubtOutliers() {
  size_t count = observations.size();
  for (size_t found = 0; found <= count / 8; ++found) {
    factor();
    size_t worst = 0;
    double most = 0;
    for (size_t i = 0; i < count; ++i) {
      double z = weights[i] / std::sqrt(findPrecision(i));
      if (doubts[i] == 0 && z > most) {
        most = z;
        worst = i;
      }
    }
    if (most < outlier)
      return;
    doubts[worst] = disbelief;
  }
  factor();
}

void CostModel::fit(std::vector<Observation> all) {
  observations = std::move(all);
  mean = 0;
  for (const Observation &observation : observations)
    mean += observation.logTime / double(observations.size());
  doubts.assign(observations.size(), 0);
  doubtOutliers();
  if (observations.size() < learned + learned / 8 + 2)
    return;
  learned = observations.size();
  learn();
  doubts.assign(observations.size(), 0);
  doubtOutliers();
}

void CostModel::believe(const Setting &setting) {
  // In a round of its own, and with no noise but what is in the prediction.
  double logTime = predict(setting).mean;
  observations.push_back(
      {setting, firstOwnRound + observations.size(), logTime});
  doubts.push_back(0);
  append(observations.size() - 1);
  solve();
}

CostModel::Prediction CostModel::predict(const Setting &setting) const {
  std::vector<double> alike;
  Prediction result{.mean = mean};
  for (size_t i = 0; i < observations.size(); ++i) {
    alike.push_back(priorOfMean + compare(observations[i].setting, setting));
    result.mean += weights[i] * alike[i];
  }
  double variance = priorOfMean + parameters.scale;
  for (double value : solveLower(std::move(alike)))
    variance -= value * value;
  result.deviation = std::sqrt(std::max(variance, 0.0));
  return result;
}
