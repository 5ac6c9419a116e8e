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

double CostModel::factor() {
  auto count = Eigen::Index(observations.size());
  Eigen::MatrixXd matrix(count, count);
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    values[i] = observations[i].logTime - mean;
    for (Eigen::Index j = 0; j <= i; ++j)
      matrix(i, j) = covariance(i, j);
  }
  cholesky.compute(matrix);
  weights = cholesky.solve(values);
  return -cholesky.matrixLLT().diagonal().array().log().sum() -
         weights.dot(values) / 2;
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

/// What the others let expect of an observation, for all of them, follows from
/// the diagonal of the inverse (leave-one-out).
void CostModel::doubtOutliers() {
  size_t count = observations.size();
  for (size_t found = 0; found <= count / 8; ++found) {
    factor();
    Eigen::VectorXd precision =
        cholesky.solve(Eigen::MatrixXd::Identity(count, count)).diagonal();
    size_t worst = 0;
    double most = 0;
    for (size_t i = 0; i < count; ++i) {
      double z = weights[i] / std::sqrt(precision[i]);
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
  factor();
}

CostModel::Prediction CostModel::predict(const Setting &setting) const {
  Eigen::VectorXd alike(observations.size());
  for (size_t i = 0; i < observations.size(); ++i)
    alike[i] = priorOfMean + compare(observations[i].setting, setting);
  double variance = priorOfMean + parameters.scale -
                    cholesky.matrixL().solve(alike).squaredNorm();
  return {.mean = mean + weights.dot(alike),
          .deviation = std::sqrt(std::max(variance, 0.0))};
}
