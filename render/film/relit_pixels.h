// How noisy a picture of one pass is, measured: some of its pixels are lit again.
//
// The samples of a pixel follow a randomised sequence that fills the square more evenly than chance
// does. Their spread about their mean, which is all that a pass knows of itself, says how far a
// mean of independent samples would be off, and overstates the variance of a smooth light's mean up
// to thirty times. Pixels drawn at random are therefore lit `runs` times more, each time with other
// random words and as many samples as in the picture (independent replicates, Owen 1997):
//
//   V = sum_k v_k / (m p_k),   v_k = sum_r (x_kr - mean_r x_kr)^2 / (runs - 1)
//
// for m draws k of probability p_k; x is the luminance of the radiance. E v_k is the variance of
// the pixel whatever its samples follow, and E V the sum of all pixels' variances whatever p is
// (Hansen and Hurwitz 1943), as the picture's own samples enter p alone: three quarters of p follow
// what the picture states of the noise around each pixel, so that few pixels that hold most of the
// noise are found. The picture's variances are scaled so that they add up to V.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/core/random.h"

namespace luxfield::render {

class RelitPixels {
 public:
  struct Draw {
    std::size_t pixel = 0;
    double weight = 0;  // 1 / (m p)
  };

  explicit RelitPixels(std::uint64_t seed) : seed_(seed) {}

  // Begins a picture of so many surface points. An eighth as many are lit again, at least 256 and
  // at most 8192. Where pixels share `shared_sets` sets of samples (0: each has its own) and so err
  // alike, fewer are lit more often.
  void Start(std::size_t points, int shared_sets);

  int runs() const { return runs_; }
  std::uint64_t Seed(int run) const;  // of the random streams of a run

  // Draws from pixels that state these variances, in their order; a pixel may come twice. None if
  // all variances are 0. Draws follow `guides`, which are guesses of the pixels' variances. Where
  // `parts`, of the same pixels, are wanted by themselves, half of what follows the guides follows
  // theirs, each alike: what is little of the whole is found too.
  std::vector<Draw> Choose(std::span<const float> stated, std::span<const float> guides,
                           std::span<const std::vector<float>> parts = {});
  std::size_t drawn() const { return drawn_; }  // since Start()
  // What the runs showed of these draws: luminance[run][draw].
  void Add(std::span<const Draw> draws, std::span<const std::vector<double>> luminance);
  // V of what these draws showed, which may be a part of the luminance: one light's.
  static double Variance(std::span<const Draw> draws,
                         std::span<const std::vector<double>> luminance);

  // V over the sum of what the pixels state that Choose() was given; 1 where that is 0.
  double Scale() const { return stated_ > 0 ? measured_ / stated_ : 1; }
  // Variance of the logarithm of V over the draws, which are taken as independent, and over shared
  // sets.
  double LogVariance() const;

 private:
  std::uint64_t seed_;
  core::Random random_{0, 0};
  int shared_sets_ = 0, runs_ = 2;
  double draws_per_point_ = 0;
  std::size_t drawn_ = 0;
  double stated_ = 0, measured_ = 0, measured_variance_ = 0;
};

}  // namespace luxfield::render
