// The film of a band of a picture. It stays on the device until the band is finished: what each
// light, pass and pixel sample adds, and what the spread between passes says of the variance, is
// summed there, and comes back once.
//
// Memory: 100 bytes a pixel, 12 more where there are several passes; of each light that is told
// apart 16, 12 more where there are several passes; of each light group 32.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "luxfield/core/colour.h"
#include "luxfield/render/device/device.h"
#include "luxfield/render/estimators/estimator.h"
#include "luxfield/render/kernels/film/lit_draw_types.clh"
#include "luxfield/render/scene/gbuffer.h"

namespace luxfield::render {

// Its kernels, built once for all bands (cached on disk).
struct FilmKernels {
  explicit FilmKernels(const Device& device);
  Device device;
  Kernel add_light, add_drawn_lights, add_drawn_group, add_pass, add_luminances, add_variances,
      add_radiance, add_hits, gather_pixels;
};

// RGB in xyz of each pixel, float4.
struct FilmLight {
  Buffer radiance, irradiance;
  FilmLight(const Device& device, std::size_t pixels);  // zeros
};

// Surface points of a band that are lit together.
struct FilmPart {
  const GBuffer& gbuffer;    // of these points alone
  const Lighting& lighting;  // what an estimator found for them
  const Buffer& pixels;      // int: which pixels of the band they are; null: all, in order
};

// The lights that points [first_point, first_point + starts.size() - 1) of a part drew: of the k-th
// draws[starts[k]] to draws[starts[k + 1]], each light once.
struct FilmDraws {
  std::size_t first_point = 0;
  std::span<const cl_int> starts;
  std::span<const LitDraw> draws;  // into `found`
  const Lighting& found;
};

// What one pass shows: sums over the lights. Row 0 of `luminances` and `stated` is of all lights,
// row 1 + l of light l where lights are told apart.
class PassSums {
 public:
  PassSums(FilmKernels& kernels, std::size_t pixels, std::size_t lights_apart);

  void Clear();
  // Adds light `light`, each channel times its `scale`, and 1 / passes of it to `group`, if that is not null.
  // Enqueues and returns.
  void Add(const FilmPart& part, const core::Rgb& scale, std::size_t light, FilmLight* group,
           int passes);
  // Adds what points drew, the part's `lighting` aside, and 1 / passes of it to the groups, of which
  // there may be none.
  void Add(const FilmPart& part, const FilmDraws& drawn, std::span<FilmLight> groups, int passes);

  std::size_t pixels() const { return pixels_; }
  std::size_t rows() const { return rows_; }
  // Of a row, as the estimators found it: luminance of the radiance, and its variance as they state
  // it. Waits.
  std::vector<float> Luminances(std::size_t row) const;
  std::vector<float> StatedVariances(std::size_t row) const;

 private:
  friend class BandFilm;
  FilmKernels& kernels_;
  std::size_t pixels_, rows_;
  FilmLight light_;
  Buffer samples_, luminances_, stated_;
};

class BandFilm {
 public:
  struct Size {
    std::size_t pixels = 0, lights_apart = 0, groups = 0;
    int passes = 1;
  };
  // Black. Throws DeviceError if the device cannot hold it.
  BandFilm(FilmKernels& kernels, const Size& size);

  // Begins a pixel sample of this G-buffer.
  void AddHits(const GBuffer& gbuffer);
  // Where that hit something 1, elsewhere 0. Waits.
  std::vector<float> Hits() const { return hits_.Download<float>(); }
  // Adds `scale` times radiance that is there without lights, to `group` as well if that is not
  // negative.
  void AddRadiance(const Buffer& radiance, double scale, int group);
  PassSums& pass_sums() { return sums_; }
  FilmLight* group(std::size_t group) { return &groups_[group]; }
  std::span<FilmLight> groups() { return groups_; }
  // Adds what pass_sums() hold after pass `pass`.
  void AddPass(int pass);
  // Ends a pixel sample, after its passes.
  void AddVariances();

  // Sums over pixel samples of means over passes.
  struct Sums {
    std::vector<cl_float4> radiance, irradiance;
    std::vector<float> coverage, samples;
    std::vector<float> stated;  // variance of the luminance as passes state it
    // Of all lights and, where they are told apart, of each, as PassSums has rows: the variance of
    // the luminance, and the luminance (sum over passes).
    std::vector<std::vector<float>> variance, luminance;
    std::vector<std::vector<cl_float4>> group_radiance, group_irradiance;
  };
  Sums Download() const;  // waits

 private:
  FilmKernels& kernels_;
  Size size_;
  PassSums sums_;
  FilmLight light_;
  std::vector<FilmLight> groups_;
  Buffer coverage_, hits_, samples_, stated_, luminances_, variances_;
  Buffer means_, squares_;  // of luminances over the passes; null for a single pass
};

// The points `pixels` of a G-buffer as a G-buffer of their own, of one row; a point may come twice.
GBuffer GatherPoints(FilmKernels& kernels, const GBuffer& gbuffer,
                     std::span<const std::size_t> pixels);

}  // namespace luxfield::render
