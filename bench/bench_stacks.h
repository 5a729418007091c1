// `luxfield bench stacks`: response curves and merges of picture stacks beside other programs'.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace luxfield::bench {

struct BenchStacksOptions {
  int width = 640, height = 320;    // of the simulated stacks; 0: they are left out
  std::filesystem::path frobisher;  // folder with the Frobisher stack's pictures, and expected
                                    // curves; empty: left out
  std::string channels = "RGB";     // of the Frobisher stack
  std::filesystem::path folder;     // scratch
  std::uint64_t seed = 1;
};

// {merges, curves}. Rows of `merges`, one for each stack and merger:
//
//   stack        `8 bit`, `16 bit`: six pictures of 0.01 to 3.5 s of a grey ramp over 5.5 decades
//                by a simulated camera (20000 electrons, read noise 6, a curve with toe and
//                shoulder); `Frobisher R`, `G`, `B`: the channels of three JPEGs
//   merger       `ours debevec`, `ours robertson`, `ours polynomial`, and MergeWithOthers'
//   rms, median  error in %, relative to the truth after the one scale that makes the median ratio
//                1, of the pixels that the camera sees: at least 200 electrons in the longest
//                exposure and below 97 % of saturation in the shortest. rms holds errors up to
//                100 %. Frobisher: relative to a plain weighted mean through the
//                expected curve, of the pixels that one picture at least exposed to codes 10 to 245
//   seen         share of those pixels that got a number, %
//   invented     share of pixels saturated in every exposure that got one, %
//   sigma        of ours: rms of error / sigma, the curve's share included
//   calibrate_s, merge_s   wall time; pfstools does both in one
//   refused      why there is no picture
//
// Rows of `curves`, one for each of Frobisher's channels and fit: `rms` difference of g to the
// expected curve over the calibrated codes from 10 on, `in_sigma` the same in its own standard
// errors, `steps` the rms difference of the step of g from a code to the one 8 times brighter,
// which the pictures show, and the codes `from` and `to` compared.
//
// Throws InputError for a channel that is not R, G or B, and what reading the pictures throws.
nlohmann::json BenchStacks(const BenchStacksOptions& options = {});

}  // namespace luxfield::bench
