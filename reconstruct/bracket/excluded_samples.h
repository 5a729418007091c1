// Which samples of a bracket hold charge that is not theirs: clipped ones overflow.
//
// A clipped sample and its 8 neighbours are left out always. Beyond, charge runs along columns
// (and, in light that spreads within the chip, along rows) as far as it runs: from every end of a
// run of clipped samples outwards, samples are compared with what the shorter exposures predict,
//
//   e = y - d - k X,   var(e) = var(y) + k^2 var(X)      (X: Poisson estimate of the shorter ones)
//
// and while the sum of e over the next 4 exceeds 3 standard deviations and 0.2 % of the light (an
// exposure time's error), the tail goes on. Twice as far as it is seen is left out: of a tail that
// falls exponentially from A at its start, what stays in is then below sigma^2 / A. First columns,
// then rows, from what columns left out too. A tail that is left out by chance (one end in 700)
// costs some weight.
//
// Shortest frames first: where they lost samples there is little left to compare longer ones with.
// But what ran over in a shorter exposure runs over in a longer one, r times as much and so ln(r)
// decay lengths farther: its tail is left out there too, grown by ln(r) / 5 of its length, and the
// comparison begins where it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/reconstruct/bracket/merge_exposures.h"
#include "luxfield/reconstruct/bracket/pixel_bits.h"
#include "luxfield/rig/sensor_model.h"

namespace luxfield::reconstruct {

class ExcludedSamples {
 public:
  // The exposures, longest first, must outlive this. Two bits a pixel are kept of every frame with
  // a clipped sample; every frame is read once. Parallel over rows; the result does not depend on
  // the threads.
  ExcludedSamples(const rig::SensorModel& sensor, std::span<const Exposure> longest_first);

  // Of word w of a row (pixel_bits.h) of frame n: 1 is left out.
  std::uint64_t Word(std::size_t n, int row, int w) const {
    return left_out_[n] ? left_out_[n].row(row)[w] : 0;
  }
  bool At(std::size_t n, int row, int column) const {
    return left_out_[n] && left_out_[n].at(row, column);
  }

 private:
  struct Pixel {
    int row = 0, column = 0;
  };
  struct Excess {
    double value = 0, variance = 0, light = 0;  // DN; variance 0: nothing to compare with
  };
  bool MarkClipped(std::size_t n);  // into clipped_; whether any is
  void FollowColumns(std::size_t n);
  void FollowRows(std::size_t n);
  void JoinNeighboursAndTails(std::size_t n);
  void FollowTail(std::size_t n, Pixel seed, Pixel step, int room);
  Excess ExcessAt(std::size_t n, Pixel p) const;
  double Signal(std::size_t n, std::size_t pixel) const;  // DN

  const rig::SensorModel& sensor_;
  std::span<const Exposure> exposures_;
  // Of each exposure: DN per electron per second, variance but for the light's shot noise (DN^2),
  // and the sensor model's dark value.
  std::vector<double> k_, other_variance_, dark_dn_;
  std::vector<PixelBits> left_out_, tails_;  // of each, where a sample is clipped
  PixelBits clipped_;                        // of the frame at hand
};

}  // namespace luxfield::reconstruct
