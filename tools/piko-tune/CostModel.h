//===- CostModel.h - Times of settings that have not run --------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A Gaussian process over the logarithms of times. Its covariance is a product:
// each dimension in which two settings differ makes them less alike, by a
// factor that is learned. So the effect of a change is about the same next to
// other changes, but not quite, which is what interactions are; and two
// pipelines share what they may.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_TOOLS_PIKOTUNE_COSTMODEL_H
#define PIKO_TOOLS_PIKOTUNE_COSTMODEL_H

#include <Eigen/Cholesky>

#include <cstddef>
#include <vector>

namespace piko::tune {

/// The number of a value in each dimension. Those of other pipelines are 0.
using Setting = std::vector<int>;

class CostModel {
public:
  struct Observation {
    Setting setting;
    size_t round = 0; ///< a machine that is slow is so for all of a round
    double logTime = 0;
  };
  struct Prediction {
    double mean = 0, deviation = 0; ///< of the logarithm
    /// By how much it is expected to be below a logarithm, where being above it
    /// counts as 0.
    double expectImprovement(double below) const;
  };

  explicit CostModel(size_t dimensions);

  /// Learns from observations. Of those that are much slower than the others
  /// let expect, it believes that the machine disturbed them.
  void fit(std::vector<Observation> observations);
  /// Takes what is predicted of a setting as if it had been observed.
  void believe(const Setting &setting);
  Prediction predict(const Setting &setting) const;

private:
  /// Variances, of logarithms.
  struct Parameters {
    double scale = 0.05;             ///< of all effects together
    std::vector<double> differences; ///< for each dimension, of `scale`
    double noise = 1e-4, round = 1e-4;
  };

  double compare(const Setting &a, const Setting &b) const;
  double covariance(size_t i, size_t j) const;
  /// Factors the covariance, which gives the weights; returns the logarithm of
  /// the likelihood.
  double factor();
  void learn();
  void doubtOutliers();

  Parameters parameters;
  std::vector<Observation> observations;
  std::vector<double> doubts;           ///< variances added to the noise
  Eigen::LLT<Eigen::MatrixXd> cholesky; ///< of the covariance
  Eigen::VectorXd weights;              ///< of the observations
  double mean = 0;
  size_t learned = 0; ///< observations when parameters were learned
};

} // namespace piko::tune

#endif // PIKO_TOOLS_PIKOTUNE_COSTMODEL_H
